#include "bridges/udp/send_loop.h"

#include <fmt/core.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/rate_limit.h"
#include "bridges/status/statistics.h"
#include "bridges/status/status_file.h"
#include "bridges/udp/udp_sender.h"

namespace mocap::bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kUsage = 64;        // sysexits EX_USAGE
constexpr int kUnavailable = 69;  // sysexits EX_UNAVAILABLE
constexpr int kWait_ms = 50;      // the longest time until a signal is noticed
// Frames that wait while the program has no processor: half a second at 120 Hz. Then a receiver gets them all.
constexpr int kKept = 64;
constexpr auto kSilence = std::chrono::seconds(1);
constexpr auto kStatusInterval = std::chrono::seconds(1);
constexpr auto kReportInterval = std::chrono::seconds(2);

// The exposure of a frame, so that frames that arrive together after a delay count as their intervals say.
Clock::time_point time_of(const ClientFrame& frame, Clock::time_point arrived) {
  const std::int64_t exposed_ns = frame.info().exposed_at_ns;
  return exposed_ns == MOCAP_ABSENT ? arrived : Clock::time_point(std::chrono::nanoseconds(exposed_ns));
}

volatile std::sig_atomic_t stop_asked = 0;
void ask_stop(int /*signal*/) { stop_asked = 1; }

using Receivers = std::vector<std::unique_ptr<UdpSender>>;

class SendLoop {
 public:
  SendLoop(const std::string& program, const SendOptions& options, const Client& client, const Receivers& receivers,
           PacketWriter& writer)
      : program_(program),
        options_(options),
        client_(client),
        receivers_(receivers),
        writer_(writer),
        limit_(options.rate_hz),
        status_(program, options.status_file) {}

  void run() {
    while (stop_asked == 0 && (options_.seconds <= 0.0 || time_s() < options_.seconds)) {
      const bool arrived = client_.wait(frame_, kWait_ms);
      const auto now = Clock::now();
      if (arrived) {
        last_frame_ = now;
        if (limit_.admits(time_of(frame_, now))) {
          send(&frame_);
          counts_.note_added(std::chrono::nanoseconds(Clock::now() - now).count());
        }
      } else if (now - last_frame_ > kSilence) {
        last_frame_ = now;
        if (!silent_ && counts_.frames > 0) ++counts_.losses;
        silent_ = true;
        send(nullptr);
      }
      if (now >= next_report_) report_change();
      if (now >= next_status_) write_status(now);
    }
  }

  std::uint64_t frames() const { return counts_.frames; }

  void report_counts() const {
    const mocap_statistics feed = client_.statistics();
    fmt::print(stderr, "{}: frames={} packets={} bytes={} not_sent={} lost={} skipped={}\n", program_, counts_.frames,
               counts_.sent, counts_.bytes, counts_.dropped, feed.lost, feed.skipped);
  }

 private:
  double time_s() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }

  void send(const ClientFrame* frame) {
    if (frame != nullptr) {
      ++counts_.frames;
      silent_ = false;
    }
    for (const std::string& packet : writer_.write(frame, time_s())) {
      for (const auto& receiver : receivers_) send(packet, *receiver);
    }
  }

  void send(const std::string& packet, UdpSender& receiver) {
    if (!receiver.send(packet)) {
      ++counts_.dropped;
      return;
    }
    ++counts_.sent;
    counts_.bytes += packet.size();
  }

  // Prints the diagnosis when it changes.
  void report_change() {
    next_report_ = Clock::now() + kReportInterval;
    const ClientDiagnosis now = client_.diagnose();
    if (now.code == reported_) return;
    reported_ = now.code;
    fmt::print(stderr, "{}: {}\n", program_, now.sentence);
  }

  void write_status(Clock::time_point now) {
    next_status_ = now + kStatusInterval;
    std::vector<Receiver> receivers;
    for (const auto& receiver : receivers_) receivers.push_back({receiver->name(), "udp"});
    const mocap_statistics feed = client_.statistics();
    status_.write(to_json(program_, counts_, receivers, client_.diagnose().sentence, {feed.lost, feed.skipped}));
  }

  const std::string& program_;
  const SendOptions& options_;
  const Client& client_;
  const Receivers& receivers_;
  PacketWriter& writer_;
  RateLimit limit_;
  ClientFrame frame_;
  Clock::time_point started_ = Clock::now();
  Clock::time_point last_frame_ = started_;
  Clock::time_point next_report_ = started_ + kReportInterval;
  Statistics counts_;
  StatusFile status_;
  Clock::time_point next_status_ = started_;
  bool silent_ = true;
  int reported_ = -1;
};

// Opens all receivers. Returns the exit code if one fails, after printing why.
std::optional<int> open_receivers(const std::string& program, const SendOptions& options, Receivers& into) {
  for (const std::string& text : options.to) {
    const auto target = read_target(text, options.port);
    if (!target) {
      fmt::print(stderr, "{}: --to {}: expected HOST, HOST:PORT or [IPV6]:PORT\n", program, text);
      return kUsage;
    }
    std::string fault;
    auto receiver = UdpSender::open(target->host, target->port, fault);
    if (!receiver) {
      fmt::print(stderr, "{}: --to {} (port {}): {}\n", program, text, target->port, fault);
      return kUnavailable;
    }
    if (!receiver->is_local()) {
      fmt::print(stderr, "{}: sends to {} without encryption, as this protocol has none\n", program, target->host);
    }
    into.push_back(std::move(receiver));
  }
  return std::nullopt;
}

}  // namespace

int send_until_stopped(const std::string& program, SendOptions options, PacketWriter& writer) {
  options.feed.keep = kKept;
  options.feed.server_key = options.keys.server_key;
  options.feed.secret_key = options.keys.secret_key;
  std::string fault;
  const auto client = Client::open(options.feed, &fault);
  if (!client) {
    fmt::print(stderr, "{}: {}\n", program, fault);
    return kUsage;
  }
  Receivers receivers;
  if (const auto failed = open_receivers(program, options, receivers)) return *failed;
  stop_asked = 0;
  std::signal(SIGINT, ask_stop);
  std::signal(SIGTERM, ask_stop);
  SendLoop loop(program, options, *client, receivers, writer);
  loop.run();
  if (loop.frames() == 0) fmt::print(stderr, "{}: {}\n", program, client->diagnose().sentence);
  loop.report_counts();
  return loop.frames() > 0 || stop_asked != 0 ? 0 : kUnavailable;
}

}  // namespace mocap::bridge
