// An hour of 120 Hz for each bridge, as fast as it goes: no frame is lost and the memory does not grow, while receivers
// come, never send a keep-alive, and close without a word. MOCAP_BRIDGE_FRAMES=432000 runs the whole hour, in about 3
// to 7 minutes for each bridge; otherwise a minute of it runs.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/bridges/frame_number.h"
#include "bench/bridges/free_port.h"
#include "bench/bridges/people_feed.h"
#include "bench/bridges/receivers.h"
#include "bridges/lib/receiver_axes.h"
#include "bridges/natnet/server.h"
#include "bridges/rokoko/scene.h"
#include "bridges/udp/udp_sender.h"
#include "bridges/vmc/vmc.h"
#include "bridges/vrpn/server.h"
#include "clients/messages.h"
#include "feed.h"
#include "frame.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "support/sanitized.h"
#include "wire/codec/encode.h"

namespace mocap::bridge {
namespace {

// Frames without MOCAP_BRIDGE_FRAMES.
constexpr std::uint64_t kShort = support::kSanitized ? 1500 : 6000;
constexpr std::uint64_t kStayEach = 150;       // frames between two departures of a visitor
constexpr std::uint64_t kDescribeEach = 1000;  // frames between two changes of the description
constexpr std::uint64_t kLoseEach = 1200;      // frames between two losses of the feed
constexpr std::size_t kClients = 7;            // that stay
constexpr std::size_t kVisitors = 3;           // that come and go
constexpr int kPeople = 3;
constexpr bench::FrameTimes kTimes{
    .first_ns = 864'000'000'000'000, .period_ns = 8'333'333, .utc_minus_host_ns = client::testing::kUtcMinusHost_ns};

std::uint64_t wanted_frames() {
  const char* text = std::getenv("MOCAP_BRIDGE_FRAMES");
  return text == nullptr ? kShort : std::strtoull(text, nullptr, 10);
}

// Memory of this process in RAM.
std::int64_t resident_bytes() {
  std::int64_t all_pages = 0, resident_pages = 0;
  std::ifstream("/proc/self/statm") >> all_pages >> resident_pages;
  return resident_pages * ::sysconf(_SC_PAGESIZE);
}

// Memory that this process has allocated and not freed.
std::int64_t used_bytes() {
  const auto info = ::mallinfo2();
  return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
}

// The frames of a feed of people, through the decoder of the client.
class LongFeed {
 public:
  explicit LongFeed(int axes) : feed_({"tcp://127.0.0.1:5570", "snapshot", axes, 1, 1}) {
    const MarkerSet set = *settings::load_marker_set(support::source_folder() + "/config/markersets/baseline41.toml");
    description_.session_id = "endurance";
    description_.nominal_rate_hz = 120.0;
    for (int i = 0; i < kPeople; ++i) description_.subjects.push_back({"person" + std::to_string(i), set});
    at_origin_ = bench::people_at_origin(description_);
    moved_ = at_origin_;
    feed_.note({.connected = true, .since_ns = 0, .connections = 1});
    describe(1);
  }

  void describe(std::uint32_t version) {
    description_.version = version;
    moved_.description_version = version;
    feed_.take(client::testing::envelope("description", wire::encode(description_)), now_);
  }

  // The positions repeat, so that they stay in the volume.
  const ClientFrame& frame(std::uint64_t number) {
    now_ = {kTimes.exposed_ns(number), kTimes.exposed_ns(number) + kTimes.utc_minus_host_ns};
    bench::move_people(at_origin_, bench::kStep_m * static_cast<double>(number), moved_);
    moved_.number = number;
    moved_.instants.exposed_at = from_ns(now_.host_ns);
    message_.Clear();
    wire::encode(moved_, message_);
    message_.set_utc_minus_host_ns(kTimes.utc_minus_host_ns);
    feed_.take(client::testing::envelope("snapshot", message_), now_);
    EXPECT_TRUE(feed_.hand_out(frame_.raw()->frame, now_));
    return frame_;
  }

 private:
  client::Now now_;
  Description description_;
  Snapshot at_origin_, moved_;
  v1::Snapshot message_;
  client::Feed feed_;
  ClientFrame frame_;
};

UdpSocket open_port(std::uint16_t port = 0) {
  std::string fault;
  auto socket = UdpSocket::open({INADDR_LOOPBACK, port}, fault);
  EXPECT_TRUE(socket.has_value()) << fault;
  return *std::move(socket);
}

// A receiver that reads everything at once, and closes without a word.
class Guest {
 public:
  Guest(std::unique_ptr<bench::Joining> joining, const bench::NumberReader& number, std::uint16_t port = 0)
      : socket_(open_port(port)), joining_(std::move(joining)), number_(number) {
    joining_->ask(socket_);
  }

  void read() {
    joining_->drain();
    socket_.receive([this](const Peer& /*from*/, std::string_view packet) {
      const auto frame = number_(packet);
      if (!frame) return joining_->answer(socket_, packet);
      if (newest_ == 0) first_ = *frame;
      if (*frame != newest_) ++frames_;
      newest_ = *frame;
    });
  }

  std::uint16_t port() const { return socket_.bound().port; }
  bool has_all_until(std::uint64_t last) const { return newest_ == last && frames_ == last - first_ + 1; }
  bool has_any() const { return frames_ > 0; }
  std::string history() const {
    return std::to_string(frames_) + " frames from " + std::to_string(first_) + " to " + std::to_string(newest_);
  }

 private:
  UdpSocket socket_;
  std::unique_ptr<bench::Joining> joining_;
  const bench::NumberReader& number_;
  std::uint64_t first_ = 0, newest_ = 0, frames_ = 0;
};

// Guests that stay, and visitors of which the oldest leaves when a new one comes.
class Guests {
 public:
  /// `port`: 0, or the port of the visitor that left.
  using Enter = std::function<std::unique_ptr<Guest>(std::uint16_t port)>;

  explicit Guests(Enter enter) : enter_(std::move(enter)) {
    for (std::size_t i = 0; i < kClients; ++i) staying_.push_back(enter_(0));
    for (std::size_t i = 0; i < kVisitors; ++i) visitors_.push_back(enter_(0));
  }

  void read() {
    for (const auto& one : staying_) one->read();
    for (const auto& one : visitors_) one->read();
  }

  void replace_a_visitor() {
    served_ += visitors_.front()->has_any() ? 1 : 0;
    ++left_;
    const std::uint16_t port = visitors_.front()->port();
    visitors_.pop_front();
    visitors_.push_back(enter_(port));
  }

  void expect_all_frames(std::uint64_t last) const {
    for (const auto& one : staying_) EXPECT_TRUE(one->has_all_until(last)) << one->history();
    EXPECT_EQ(served_, left_) << "visitors that got frames, and all visitors";
  }

 private:
  Enter enter_;
  std::vector<std::unique_ptr<Guest>> staying_;
  std::deque<std::unique_ptr<Guest>> visitors_;
  std::uint64_t served_ = 0, left_ = 0;
};

// The memory after a quarter of the run and at its end: in RAM, and in the heap, where freed memory of the start would
// hide a short growth.
class Growth {
 public:
  void note(std::uint64_t frame, std::uint64_t frames) {
    if (frame != frames / 4) return;
    before_bytes_ = resident_bytes();
    before_used_bytes_ = used_bytes();
  }
  void expect_none() const {
    constexpr std::int64_t kMost_bytes = 1 << 20;
    const std::int64_t grown_bytes = resident_bytes() - before_bytes_;
    ::testing::Test::RecordProperty("grown_bytes", static_cast<int>(grown_bytes));
    if (support::kSanitized) return;  // sanitizers keep freed memory
    EXPECT_LT(grown_bytes, kMost_bytes);
    EXPECT_LT(used_bytes() - before_used_bytes_, kMost_bytes);
  }

 private:
  std::int64_t before_bytes_ = 0;
  std::int64_t before_used_bytes_ = 0;
};

// Runs a bridge with clients in one thread: `tick` of the loop sends one frame, then the loop serves the sockets.
template <class Server>
void run_server(Server& server, EventLoop& loop, Guests& guests) {
  LongFeed feed(MOCAP_AXES_MOCAP);
  Growth growth;
  const std::uint64_t frames = wanted_frames();
  std::uint64_t number = 0;
  bool anew = true;
  loop.run(std::chrono::milliseconds(0), [&] {
    ++number;
    const ClientFrame& frame = feed.frame(number);
    server.take(frame, std::exchange(anew, false));
    guests.read();
    server.tick();
    growth.note(number, frames);
    if (number == frames) return loop.stop();
    if (number % kStayEach == 0) guests.replace_a_visitor();
    if (number % kLoseEach == 0) server.lose(&frame);
    if (number % kDescribeEach == 0) {
      feed.describe(static_cast<std::uint32_t>(number));
      anew = true;
    }
  });
  guests.read();
  guests.expect_all_frames(number);
  growth.expect_none();
}

TEST(Endurance, NatNetServesEveryFrameWithoutGrowth) {
  const std::uint16_t port = *bench::free_port();
  Statistics statistics;
  natnet::ServerOptions options;
  options.command_port = port;
  natnet::Server server(options, statistics);
  EventLoop loop;
  ASSERT_EQ(server.open(loop), "");
  const bench::NumberReader number = bench::natnet_number;
  Guests guests([&](std::uint16_t /*port*/) { return std::make_unique<Guest>(bench::join_natnet(port), number); });

  run_server(server, loop, guests);

  EXPECT_LE(server.receivers().size(), kClients + kVisitors + 1);  // one may just have left
}

TEST(Endurance, VrpnServesEveryFrameWithoutGrowth) {
  const std::uint16_t port = *bench::free_port();
  Statistics statistics;
  vrpn::Server server({.at = {INADDR_LOOPBACK, port}, .axes = vrpn_axes()}, statistics);
  EventLoop loop;
  ASSERT_EQ(server.open(loop), "");
  const bench::NumberReader number = [](std::string_view packet) { return bench::vrpn_number(packet, kTimes); };
  Guests guests([&](std::uint16_t /*port*/) { return std::make_unique<Guest>(bench::join_vrpn(port), number); });

  run_server(server, loop, guests);

  EXPECT_LE(server.receivers().size(), kClients + kVisitors + 1);
}

// Runs a bridge that sends to given receivers. `write` returns the packets of a frame.
void run_sender(const bench::NumberReader& number,
                const std::function<std::vector<std::string>(const ClientFrame&)>& write) {
  LongFeed feed(MOCAP_AXES_UNITY);
  Growth growth;
  std::vector<std::unique_ptr<UdpSender>> senders;
  Guests guests([&](std::uint16_t port) {
    auto guest = std::make_unique<Guest>(bench::join_silently(), number, port);
    std::string fault;
    if (port == 0) senders.push_back(UdpSender::open("127.0.0.1", std::to_string(guest->port()), fault));
    return guest;
  });
  const std::uint64_t frames = wanted_frames();
  for (std::uint64_t frame = 1; frame <= frames; ++frame) {
    for (const std::string& packet : write(feed.frame(frame))) {
      for (const auto& sender : senders) sender->send(packet);
    }
    guests.read();
    growth.note(frame, frames);
    if (frame % kStayEach == 0 && frame != frames) guests.replace_a_visitor();
    if (frame % kDescribeEach == 0) feed.describe(static_cast<std::uint32_t>(frame));
  }
  guests.expect_all_frames(frames);
  growth.expect_none();
}

TEST(Endurance, RokokoSendsEveryFrameWithoutGrowth) {
  const bench::NumberReader number = [](std::string_view packet) { return bench::rokoko_number(packet, kTimes); };

  run_sender(number, [](const ClientFrame& frame) { return std::vector{rokoko::write_scene(&frame, {}, 0.0)}; });
}

TEST(Endurance, VmcSendsEveryFrameWithoutGrowth) {
  vmc::OscBundles bundles(1400);

  run_sender(bench::vmc_number, [&](const ClientFrame& frame) {
    const auto person = frame.subject(0);
    vmc::write_frame(&*person, 0.0F, bundles);
    return bundles.bundles();
  });
}

}  // namespace
}  // namespace mocap::bridge
