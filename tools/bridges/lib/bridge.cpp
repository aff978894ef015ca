#include "bridges/lib/bridge.h"

#include <fmt/format.h>
#include <sys/epoll.h>

#include <cstdio>
#include <optional>

#include "bridges/lib/feed_source.h"
#include "bridges/lib/udp_socket.h"
#include "bridges/status/status_file.h"

namespace mocap::bridge {
namespace {

constexpr int kUsage = 64;        // sysexits EX_USAGE
constexpr int kUnavailable = 69;  // sysexits EX_UNAVAILABLE
constexpr std::chrono::milliseconds kTick(100);
// Frames that wait while the loop is busy. At 240 Hz a quarter of a second; older ones are of no use to a live
// receiver.
constexpr int kKept = 64;
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPatience_ns = 2 * kSecond_ns;  // before the log explains why no data arrives

class Run {
 public:
  Run(std::string_view program, const BridgeOptions& options, Protocol& protocol, Statistics& statistics)
      : program_(program),
        options_(options),
        protocol_(protocol),
        statistics_(statistics),
        status_(program, options.status_file) {}

  int run() {
    EventLoop loop;
    std::string fault;
    const auto source = FeedSource::open({.endpoint = options_.endpoint,
                                          .keep = kKept,
                                          .server_key = options_.keys.server_key,
                                          .secret_key = options_.keys.secret_key},
                                         fault);
    if (!source) {
      say(program_, fault);
      return kUsage;
    }
    fault = protocol_.open(loop);
    if (!fault.empty()) {
      say(program_, fault);
      return kUnavailable;
    }
    loop.watch(source->descriptor(), EPOLLIN, [&](std::uint32_t /*events*/) { take_frames(*source); });
    loop.run(kTick, [&] { tick(loop, *source); });
    if (statistics_.frames == 0) say(program_, source->client().diagnose().sentence);
    return 0;
  }

 private:
  void take_frames(FeedSource& source) {
    source.acknowledge();
    while (source.next(frame_)) {
      const mocap_frame_info info = frame_.info();
      const bool anew = !described_ || *described_ != info.description_version || session_ != frame_.session();
      described_ = info.description_version;
      session_ = frame_.session();
      ++statistics_.frames;
      lost_ = false;
      last_ns_ = monotonic_ns();
      protocol_.take(frame_, anew);
      statistics_.note_added(monotonic_ns() - source.arrived_ns());
    }
  }

  void tick(EventLoop& loop, const FeedSource& source) {
    const std::int64_t now_ns = monotonic_ns();
    if (options_.seconds > 0.0 && static_cast<double>(now_ns - started_ns_) > options_.seconds * 1e9) loop.stop();
    protocol_.tick();
    if (static_cast<double>(now_ns - last_ns_) > options_.lost_after_s * 1e9) lose();
    if (now_ns >= next_word_ns_) report_change(source);
    if (now_ns >= next_status_ns_) write_status(source, now_ns);
  }

  void lose() {
    if (!lost_ && statistics_.frames > 0) ++statistics_.losses;
    lost_ = true;
    protocol_.lose(described_ ? &frame_ : nullptr);
  }

  void report_change(const FeedSource& source) {
    next_word_ns_ = monotonic_ns() + kPatience_ns;
    const ClientDiagnosis now = source.client().diagnose();
    if (now.code == reported_) return;
    reported_ = now.code;
    say(program_, now.sentence);
  }

  void write_status(const FeedSource& source, std::int64_t now_ns) {
    next_status_ns_ = now_ns + kSecond_ns;
    const bool logs =
        options_.statistics_s > 0.0 && static_cast<double>(now_ns - logged_ns_) >= options_.statistics_s * 1e9;
    const mocap_statistics feed = source.client().statistics();
    const std::string status = to_json(program_, statistics_, protocol_.receivers(),
                                       source.client().diagnose().sentence, {feed.lost, feed.skipped});
    if (logs) {
      logged_ns_ = now_ns;
      say(program_, status);
    }
    status_.write(status);
  }

  std::string program_;
  const BridgeOptions& options_;
  Protocol& protocol_;
  Statistics& statistics_;
  StatusFile status_;
  ClientFrame frame_;
  std::optional<std::uint32_t> described_;  // version of the description of frame_
  std::string session_;
  bool lost_ = true;
  std::int64_t started_ns_ = monotonic_ns();
  std::int64_t last_ns_ = started_ns_;  // of the newest frame
  std::int64_t next_word_ns_ = started_ns_ + kPatience_ns;
  std::int64_t next_status_ns_ = started_ns_;
  std::int64_t logged_ns_ = started_ns_;
  int reported_ = -1;
};

}  // namespace

void add_bridge_options(cli::App& app, BridgeOptions& options, bool listens) {
  app.add_option("endpoint", options.endpoint, "the feed")->capture_default_str();
  cli::add_key_options(app, options.keys);
  if (listens) {
    app.add_option("--listen", options.listen,
                   "address of this machine that receivers reach; 0.0.0.0: all its addresses. The protocol has neither "
                   "encryption nor passwords")
        ->check(cli::ValidIPV4{})
        ->capture_default_str();
  }
  app.add_option("--lost-after", options.lost_after_s, "show the loss of the daemon after this time without data, s")
      ->check(cli::Range(0.1, 60.0))
      ->capture_default_str();
  app.add_option("--statistics", options.statistics_s, "log statistics as JSON at this interval, s")
      ->check(cli::PositiveNumber{});
  app.add_option(
         "--status-file", options.status_file,
         "write the statistics to this file once a second; without it, to a file that mocapctl bridge list reads")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "end after this time")->check(cli::PositiveNumber{});
}

int run_bridge(std::string_view program, const BridgeOptions& options, Protocol& protocol, Statistics& statistics) {
  return Run(program, options, protocol, statistics).run();
}

void warn_if_open(std::string_view program, std::string_view protocol, std::uint32_t address) {
  if (is_loopback(address)) return;
  say(program, fmt::format("warning: {} has neither encryption nor passwords: every machine that reaches {} can read "
                           "the data; use it in a network of your own",
                           protocol, to_string({address, 0}).substr(0, to_string({address, 0}).find(':'))));
}

void say(std::string_view program, std::string_view text) {
  fmt::print(stderr, "{}: {}\n", program, text);
  std::fflush(stderr);
}

}  // namespace mocap::bridge
