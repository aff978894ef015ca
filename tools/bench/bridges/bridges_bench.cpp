#include "bench/bridges/bridges_bench.h"

#include <fmt/format.h>
#include <pthread.h>
#include <time.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "base/time.h"
#include "bench/bridges/frame_number.h"
#include "bench/bridges/free_port.h"
#include "bench/bridges/people_feed.h"
#include "bench/bridges/receivers.h"
#include "bench/feed/snapshot_number.h"
#include "bench/program.h"
#include "bench/wait_until.h"
#include "settings/subject/marker_set_file.h"
#include "support/temporary_folder.h"
#include "wire/zmq_subscriber.h"

namespace mocap::bench {
namespace {

constexpr double kJoinWithin_s = 20.0;
constexpr double kSettle_s = 0.5;  // between the last join and the first measured frame
constexpr Duration kPatience = std::chrono::milliseconds(20);
constexpr Duration kLastFrames = std::chrono::milliseconds(500);  // until the last frames have arrived

// The properties of a protocol that a run needs.
struct Way {
  std::string protocol;
  std::string program;                                // empty: the reference
  std::vector<std::string> options;                   // of the program
  std::function<std::unique_ptr<Joining>()> joining;  // of a receiver
  NumberReader number;
};

std::vector<std::string> receivers_of(const std::vector<std::uint16_t>& ports) {
  std::vector<std::string> options{"--rate", "1000"};
  for (const std::uint16_t port : ports) {
    options.emplace_back("--to");
    options.push_back(fmt::format("127.0.0.1:{}", port));
  }
  return options;
}

Way way_of(const std::string& protocol, std::uint16_t port, const std::vector<std::uint16_t>& ports,
           const FrameTimes& times) {
  const std::string program = "mocap-" + protocol;
  const std::string text = std::to_string(port);
  if (protocol == "natnet") {
    return {protocol, program, {"--command-port", text}, [port] { return join_natnet(port); }, natnet_number};
  }
  if (protocol == "vrpn") {
    const auto number = [times](std::string_view packet) { return vrpn_number(packet, times); };
    return {protocol, program, {"--port", text}, [port] { return join_vrpn(port); }, number};
  }
  if (protocol == "rokoko") {
    const auto number = [times](std::string_view packet) { return rokoko_number(packet, times); };
    return {protocol, program, receivers_of(ports), join_silently, number};
  }
  if (protocol == "vmc") return {protocol, program, receivers_of(ports), join_silently, vmc_number};
  return {protocol, "", {}, join_silently, reference_number};
}

// Calls `take` with each snapshot of the feed and its number, until the stop.
template <class Take>
void follow(const std::stop_token& stop, wire::ZmqSubscriber& subscriber, Take take) {
  while (!stop.stop_requested()) {
    const auto message = subscriber.next(kPatience);
    if (message) take(snapshot_number(message->payload), message->payload);
  }
}

// The reference: sends the feed to the receivers.
class Relay {
 public:
  Relay(std::unique_ptr<wire::ZmqSubscriber> subscriber, bridge::UdpSocket socket, std::vector<std::uint16_t> ports)
      : subscriber_(std::move(subscriber)),
        socket_(std::move(socket)),
        ports_(std::move(ports)),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

  double cpu_s() {
    clockid_t clock{};
    timespec used{};
    if (pthread_getcpuclockid(thread_.native_handle(), &clock) != 0 || clock_gettime(clock, &used) != 0) return 0.0;
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  }

 private:
  void run(const std::stop_token& stop) {
    follow(stop, *subscriber_, [&](std::uint64_t number, const std::string& payload) {
      std::string packet(sizeof number, '\0');
      std::memcpy(packet.data(), &number, sizeof number);
      packet += payload;
      for (const std::uint16_t port : ports_) socket_.send({INADDR_LOOPBACK, port}, packet);
    });
  }

  std::unique_ptr<wire::ZmqSubscriber> subscriber_;
  bridge::UdpSocket socket_;
  std::vector<std::uint16_t> ports_;
  std::jthread thread_;  // the last member, ends first
};

Result<std::unique_ptr<wire::ZmqSubscriber>> subscribe(const std::string& endpoint) {
  return wire::ZmqSubscriber::open({.endpoint = endpoint, .topics = {wire::kSnapshotTopic}});
}

// One protocol: the feed, a subscriber of it, the bridge and its receivers.
class Run {
 public:
  Run(const BridgesBenchSettings& settings, PeopleFeed feed, Receivers receivers, FrameTimes times)
      : settings_(settings),
        feed_(std::move(feed)),
        receivers_(std::move(receivers)),
        times_(times),
        counted_frames_(static_cast<std::uint64_t>(std::ceil(settings.seconds * settings.rate_hz))),
        join_frames_(static_cast<std::uint64_t>(kJoinWithin_s * settings.rate_hz)),
        settle_frames_(static_cast<std::uint64_t>(kSettle_s * settings.rate_hz)),
        subscribed_(1, frames()),
        received_(static_cast<std::size_t>(settings.clients), frames()) {}

  Result<BridgeFigures> measure(const std::string& protocol) {
    const Result<std::uint16_t> port = free_port();
    if (!port) return port.error();
    const Way way = way_of(protocol, *port, receivers_.ports(), times_);
    if (const Status started = start(way); !started) return started.error();
    auto subscriber = subscribe(feed_.endpoint());
    if (!subscriber) return subscriber.error();
    BridgeFigures figures;
    figures.protocol = protocol;
    FrameRange range;
    {
      const std::jthread receiving(
          [&](const std::stop_token& stop) { receivers_.run(stop, way.joining, way.number, received_, joined_); });
      const std::jthread following([&](const std::stop_token& stop) {
        follow(stop, **subscriber, [this](std::uint64_t number, const std::string& /*payload*/) {
          subscribed_.note(0, number, to_ns(host_now()));
          follows_ = true;
        });
      });
      const auto sent = send_frames(figures);
      if (!sent) return Error{sent.error().code, protocol + ": " + sent.error().message};
      range = *sent;
      std::this_thread::sleep_for(kLastFrames);
    }
    figures.added = compare(subscribed_, received_, range);
    return figures;
  }

 private:
  std::size_t frames() const { return join_frames_ + settle_frames_ + counted_frames_ + 2; }

  Status start(const Way& way) {
    if (way.program.empty()) {
      auto subscriber = subscribe(feed_.endpoint());
      if (!subscriber) return subscriber.error();
      std::string fault;
      auto socket = bridge::UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
      if (!socket) return Error{ErrorCode::Io, fault};
      relay_ = std::make_unique<Relay>(*std::move(subscriber), *std::move(socket), receivers_.ports());
      return {};
    }
    std::vector<std::string> arguments{feed_.endpoint(), "--status-file", (folder_.path() / "status.json").string()};
    arguments.insert(arguments.end(), way.options.begin(), way.options.end());
    program_ = std::make_unique<Program>(way.program, arguments);
    if (program_->runs()) return {};
    return Error{ErrorCode::NotFound, way.program + " is not in the folder of mocap-bench"};
  }

  bool all_joined() const { return joined_ >= static_cast<std::size_t>(settings_.clients) && follows_; }
  double cpu_s() { return program_ ? program_->cpu_s() : relay_->cpu_s(); }

  // Sends frames until all receivers have joined, and then the measured ones, which are returned.
  Result<FrameRange> send_frames(BridgeFigures& figures) {
    std::uint64_t number = 1;
    for (; !all_joined(); ++number) {
      if (number > join_frames_) return Error{ErrorCode::Timeout, "not every receiver got a frame within 20 s"};
      if (program_ && !program_->runs()) return Error{ErrorCode::Io, "the program ended; start it alone to see why"};
      if (const Status sent = send(number); !sent) return sent.error();
    }
    const FrameRange range{number + settle_frames_, number + settle_frames_ + counted_frames_ - 1};
    double cpu_before_s = 0.0;
    Timestamp began = host_now();
    for (; number <= range.last; ++number) {
      if (number == range.first) {
        cpu_before_s = cpu_s();
        began = host_now();
      }
      if (const Status sent = send(number); !sent) return sent.error();
    }
    figures.cpu_share = (cpu_s() - cpu_before_s) / to_s(host_now() - began);
    return range;
  }

  Status send(std::uint64_t number) {
    wait_until(from_ns(times_.exposed_ns(number)));
    return feed_.send(number, times_);
  }

  const BridgesBenchSettings& settings_;
  support::TemporaryFolder folder_;
  PeopleFeed feed_;
  Receivers receivers_;
  FrameTimes times_;
  std::uint64_t counted_frames_, join_frames_, settle_frames_;
  Arrivals subscribed_, received_;
  std::atomic<std::size_t> joined_{0};
  std::atomic<bool> follows_{false};
  std::unique_ptr<Program> program_;
  std::unique_ptr<Relay> relay_;
};

Result<BridgeFigures> measure(const BridgesBenchSettings& settings, const MarkerSet& set, const std::string& protocol) {
  auto feed = PeopleFeed::open(set, settings.subjects, settings.rate_hz);
  if (!feed) return feed.error();
  auto receivers = Receivers::open(static_cast<std::size_t>(settings.clients));
  if (!receivers) return receivers.error();
  const FrameTimes times{.first_ns = to_ns(host_now()),
                         .period_ns = from_s(1.0 / settings.rate_hz).count(),
                         .utc_minus_host_ns = utc_minus_host().count()};
  Run run(settings, *std::move(feed), *std::move(receivers), times);
  return run.measure(protocol);
}

}  // namespace

Result<BridgesBenchFigures> run_bridges_bench(const BridgesBenchSettings& settings) {
  BridgesBenchFigures figures;
  getloadavg(&figures.load, 1);
  const Result<MarkerSet> set = settings::load_marker_set(settings.marker_set);
  if (!set) return set.error();
  for (const char* protocol : {"natnet", "vrpn", "rokoko", "vmc"}) {
    if (!settings.only.empty() && settings.only != protocol) continue;
    auto measured = measure(settings, *set, protocol);
    if (!measured) return measured.error();
    figures.bridges.push_back(*std::move(measured));
  }
  auto reference = measure(settings, *set, "reference");
  if (!reference) return reference.error();
  figures.reference = *std::move(reference);
  return figures;
}

}  // namespace mocap::bench
