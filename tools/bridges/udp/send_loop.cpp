#include "bridges/udp/send_loop.h"

#include <fmt/core.h>

#include <chrono>
#include <csignal>
#include <cstdint>

#include "bridges/status/statistics.h"
#include "bridges/status/status_file.h"
#include "bridges/udp/rate_limit.h"
#include "bridges/udp/udp_sender.h"

namespace mocap::bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kUsage = 64;        // sysexits EX_USAGE
constexpr int kUnavailable = 69;  // sysexits EX_UNAVAILABLE
constexpr int kWait_ms = 50;      // the longest time until a signal is noticed
constexpr auto kSilence = std::chrono::seconds(1);
constexpr auto kStatusInterval = std::chrono::seconds(1);
constexpr auto kReportInterval = std::chrono::seconds(2);

volatile std::sig_atomic_t stop_asked = 0;
void ask_stop(int /*signal*/) { stop_asked = 1; }

class SendLoop {
 public:
  SendLoop(const std::string& program, const SendOptions& options, const Client& client, UdpSender& receiver,
           PacketWriter& writer)
      : program_(program),
        options_(options),
        client_(client),
        receiver_(receiver),
        writer_(writer),
        limit_(options.rate_hz),
        status_(program, options.status_file) {}

  void run() {
    while (stop_asked == 0 && (options_.seconds <= 0.0 || time_s() < options_.seconds)) {
      const bool arrived = client_.wait(frame_, kWait_ms);
      const auto now = Clock::now();
      if (arrived) {
        last_frame_ = now;
        if (limit_.admits(now)) {
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
    fmt::print(stderr, "{}: frames={} packets={} bytes={} not_sent={} lost={}\n", program_, counts_.frames,
               counts_.sent, counts_.bytes, counts_.dropped, client_.statistics().lost);
  }

 private:
  double time_s() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }

  void send(const ClientFrame* frame) {
    if (frame != nullptr) {
      ++counts_.frames;
      silent_ = false;
    }
    for (const std::string& packet : writer_.write(frame, time_s())) {
      if (!receiver_.send(packet)) {
        ++counts_.dropped;
        continue;
      }
      ++counts_.sent;
      counts_.bytes += packet.size();
    }
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
    status_.write(to_json(program_, counts_, {{options_.host + ":" + options_.port, "udp"}},
                          client_.diagnose().sentence, client_.statistics().lost));
  }

  const std::string& program_;
  const SendOptions& options_;
  const Client& client_;
  UdpSender& receiver_;
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

}  // namespace

int send_until_stopped(const std::string& program, SendOptions options, PacketWriter& writer) {
  options.feed.server_key = options.keys.server_key;
  options.feed.secret_key = options.keys.secret_key;
  std::string fault;
  const auto client = Client::open(options.feed, &fault);
  if (!client) {
    fmt::print(stderr, "{}: {}\n", program, fault);
    return kUsage;
  }
  const auto receiver = UdpSender::open(options.host, options.port, fault);
  if (!receiver) {
    fmt::print(stderr, "{}: --to {} --port {}: {}\n", program, options.host, options.port, fault);
    return kUnavailable;
  }
  std::signal(SIGINT, ask_stop);
  std::signal(SIGTERM, ask_stop);
  if (!receiver->is_local()) {
    fmt::print(stderr, "{}: sends to {} without encryption, as this protocol has none\n", program, options.host);
  }
  SendLoop loop(program, options, *client, *receiver, writer);
  loop.run();
  if (loop.frames() == 0) fmt::print(stderr, "{}: {}\n", program, client->diagnose().sentence);
  loop.report_counts();
  return loop.frames() > 0 ? 0 : kUnavailable;
}

}  // namespace mocap::bridge
