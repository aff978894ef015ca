// mocap-watch: shows a feed, or prints it as JSON lines.
#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

#include "base/exit_codes.h"
#include "lib/cli/app.h"
#include "lib/cli/key_options.h"
#include "lib/cli/shown_text.h"
#include "watch/doctor.h"
#include "watch/feed_state.h"
#include "watch/line_writer.h"
#include "watch/report.h"
#include "watch/take_player.h"
#include "wire/codec/json.h"
#include "wire/zmq_subscriber.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr Duration kPatience = std::chrono::milliseconds(50);
constexpr Duration kSilence = std::chrono::seconds(2);            // silence after which the reason is printed
constexpr Duration kFaultLasts = std::chrono::milliseconds(700);  // the same without a connection
constexpr int kQueueEveryFrame = 5000;  // every frame is printed although the reader pauses: 20 s at 240 Hz

volatile std::sig_atomic_t stop_asked = 0;
void ask_stop(int /*signal*/) { stop_asked = 1; }

// Also while a call waits in the kernel: std::signal would continue that call.
void end_at(int signal) {
  struct sigaction action {};
  action.sa_handler = ask_stop;
  ::sigaction(signal, &action, nullptr);
}

struct Options {
  std::string endpoint = "tcp://127.0.0.1:5570";
  bool json = false;
  std::optional<double> seconds;
  std::optional<std::uint64_t> frames;
  std::string summary;
  bool doctor = false;
  cli::KeyOptions keys;
};

// Shows a status line: overwrites the line on a terminal, prints a new line elsewhere.
class Display {
 public:
  explicit Display(std::FILE* to) : to_(to), terminal_(::isatty(::fileno(to)) != 0) {}

  Duration pace() const { return terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(1000); }

  // Width of the terminal. A line that wraps cannot be overwritten.
  std::size_t columns() const {
    winsize size{};
    if (!terminal_ || ::ioctl(::fileno(to_), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return std::string::npos;
    return size.ws_col - std::size_t{1};
  }

  // `line` is the result of cli::shown().
  void show(const std::string& line) {
    std::fputs(terminal_ ? "\r\x1b[2K" : "", to_);
    std::fputs(line.c_str(), to_);
    if (!terminal_) std::fputc('\n', to_);
    std::fflush(to_);
    shown_ = true;
  }
  void end() {
    if (terminal_ && shown_) std::fputc('\n', to_);
    std::fflush(to_);
  }

 private:
  std::FILE* to_;
  bool terminal_;
  bool shown_ = false;
};

// The messages that are watched: of a feed, or of a take.
struct Source {
  std::function<Result<wire::FeedMessage>(Duration patience)> next;
  std::function<std::string(const watch::FeedState& feed, Duration silent_for)> reason_for_silence;
  std::function<bool()> has_fault;
};

class Watch {
 public:
  Watch(const Options& options, const Source& source)
      : options_(options), source_(source), display_(options.json ? stderr : stdout), started_(host_now()) {}

  // Returns false if standard output is closed.
  bool run() {
    Timestamp next_show = started_ + display_.pace();
    while (!over()) {
      if (!drain()) {
        if (stop_asked == 0) return false;
        break;  // nobody reads the rest
      }
      const Timestamp now = host_now();
      if (now < next_show) continue;
      next_show = now + display_.pace();
      show(now);
    }
    display_.end();
    return true;
  }

  const watch::FeedState& feed() const { return feed_; }
  Duration watched() const { return host_now() - started_; }

 private:
  bool enough() const { return options_.frames && feed_.frames() >= *options_.frames; }
  bool over() const {
    return stop_asked != 0 || ended_ || enough() ||
           (options_.seconds && to_s(host_now() - started_) >= *options_.seconds);
  }

  // Processes all waiting messages, so that the display shows the newest state. A fault ends the row: a source that
  // fails again and again does not stop the display.
  bool drain() {
    Result<wire::FeedMessage> message = source_.next(kPatience);
    for (; message; message = source_.next(Duration(0))) {
      const v1::Snapshot* snapshot = feed_.take(*message, host_now());
      if (snapshot != nullptr && options_.json && !print(*snapshot)) return false;
      if (over()) return true;
    }
    const Error& fault = message.error();
    ended_ = fault.code == ErrorCode::EndOfStream;
    if (!ended_ && fault.code != ErrorCode::Timeout) feed_.note_fault(fault.message);
    return true;
  }

  bool print(const v1::Snapshot& snapshot) const { return lines_.write(wire::to_json_line(snapshot) + '\n'); }

  void show(Timestamp now) {
    const Duration silent_for = now - std::max(started_, feed_.last_arrival());
    if (silent_for >= (source_.has_fault() ? kFaultLasts : kSilence)) {
      display_.show(cli::shown(source_.reason_for_silence(feed_, silent_for), display_.columns()));
    } else if (!options_.json && feed_.last()) {
      display_.show(watch::status_line(feed_, now, display_.columns()));
    }
  }

  const Options& options_;
  const Source& source_;
  Display display_;
  watch::LineWriter lines_{STDOUT_FILENO, [] { return stop_asked != 0; }};
  watch::FeedState feed_;
  Timestamp started_;
  bool ended_ = false;  // the take
};

bool write_summary(const std::string& to, const std::string& summary) {
  if (to == "-") return std::puts(summary.c_str()) >= 0 && std::fflush(stdout) == 0;
  std::ofstream out(to);
  out << summary << '\n';
  return static_cast<bool>(out.flush());
}

// Returns the exit code.
int watch_source(const Options& options, const Source& source) {
  Watch watch(options, source);
  const bool written = watch.run();
  if (watch.feed().frames() == 0) {
    fmt::print(stderr, "mocap-watch: {}\n", cli::shown(source.reason_for_silence(watch.feed(), watch.watched())));
  }
  if (watch.feed().unreadable() > 0) {
    fmt::print(stderr, "mocap-watch: passed over {} unreadable parts; the last: {}\n", watch.feed().unreadable(),
               cli::shown(watch.feed().last_fault()));
  }
  if (!options.summary.empty() &&
      !write_summary(options.summary, watch::summary_json(watch.feed(), options.endpoint, watch.watched()))) {
    fmt::print(stderr, "mocap-watch: the summary cannot be written to '{}'\n", options.summary);
    return kExitCannotWrite;
  }
  if (!written) return kExitCannotWrite;
  return watch.feed().frames() > 0 ? 0 : kExitUnavailable;
}

int watch_feed(const Options& options) {
  wire::SubscriberSettings settings;
  settings.endpoint = options.endpoint;
  settings.receive_queue = kQueueEveryFrame;
  Result<wire::ClientKeys> keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  if (!keys) {
    fmt::print(stderr, "mocap-watch: {}\n", keys.error().message);
    return kExitUsage;
  }
  settings.keys = *std::move(keys);
  const auto subscriber = wire::ZmqSubscriber::open(settings);
  if (!subscriber) {
    fmt::print(stderr, "mocap-watch: {}\n", subscriber.error().message);
    return kExitUsage;
  }
  return watch_source(options, {[&](Duration patience) { return (*subscriber)->next(patience); },
                                [&](const watch::FeedState& feed, Duration silent_for) {
                                  return watch::reason_for_silence(feed, (*subscriber)->link(), options.endpoint,
                                                                   silent_for);
                                },
                                [&] { return (*subscriber)->link().fault != wire::LinkFault::None; }});
}

bool is_take(const std::string& endpoint) { return std::filesystem::path(endpoint).extension() == ".mcap"; }

int watch_take(const Options& options) {
  auto player =
      watch::TakePlayer::open(options.endpoint, options.json ? watch::PlayPace::AtOnce : watch::PlayPace::Recorded);
  if (!player) {
    fmt::print(stderr, "mocap-watch: {}\n", player.error().message);
    return player.error().code == ErrorCode::NotFound ? kExitNoInput : kExitData;
  }
  return watch_source(options,
                      {[&](Duration patience) { return player->next(patience); },
                       [](const watch::FeedState&, Duration) { return std::string("the take has no snapshots here"); },
                       [] { return false; }});
}

int doctor(const Options& options) {
  watch::DoctorOptions asked{options.endpoint, options.keys.server_key, options.keys.secret_key};
  if (options.seconds) asked.seconds = *options.seconds;
  const watch::DoctorWord word = watch::ask_doctor(asked);
  fmt::print(word.exit_code == 0 ? stdout : stderr, "mocap-watch: {}\n", cli::shown(word.sentence));
  return word.exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cli::App app("Shows the feed of a mocapd. Exit code 0 if data arrived, 69 if not.", "mocap-watch");
  app.footer(R"(examples:
  mocap-watch                                     the live state of the daemon on this machine
  mocap-watch tcp://127.0.0.1:5570 --seconds 10   for ten seconds
  mocap-watch --json > stream.jsonl               every snapshot as a line of JSON, until Ctrl-C
  mocap-watch takes/walk-3.mcap                   plays a take
  mocap-watch takes/walk-3.mcap --json            prints its snapshots at once
  mocap-watch --doctor tcp://10.0.0.7:5570        why no data arrives or a subject
                                                  is not found, and what helps
  mocap-watch tcp://10.0.0.7:5570 --server-key server.key --secret-key anna.key
                                                  a daemon that demands keys
exit codes of --doctor: 0 well, 11 nothing listens, 12 no feed, 13 a key is
missing, 14 our key is refused, 15 the server's key is wrong, 16 no description,
17 version too new, 18 cameras silent, 19 no snapshots, 20 subject searching,
21 clock skew, 22 too early to say, 40 a camera contributes nothing,
41 no timecode)");
  app.add_option("endpoint", options.endpoint, "endpoint of the feed, or a take (.mcap)")->capture_default_str();
  app.add_flag("--json", options.json, "print every snapshot as a line of JSON");
  app.add_option("--seconds", options.seconds, "end after this time")->check(cli::PositiveNumber{});
  app.add_option("--frames", options.frames, "end after this many snapshots")->check(cli::PositiveNumber{});
  app.add_option("--summary", options.summary, "at the end, write one JSON object to this file (-: standard output)");
  app.add_flag("--doctor", options.doctor, "say why there is no data");
  cli::add_key_options(app, options.keys);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  if (options.json && options.summary == "-") {
    fmt::print(stderr, "mocap-watch: --json already prints to standard output; give --summary a file\n");
    return kExitUsage;
  }
  if (options.doctor && is_take(options.endpoint)) {
    fmt::print(stderr, "mocap-watch: --doctor is for feeds; mocapctl take verify checks a take\n");
    return kExitUsage;
  }
  if (options.doctor) return doctor(options);
  end_at(SIGINT);
  end_at(SIGTERM);
  std::signal(SIGPIPE, SIG_IGN);  // a closed reader becomes an error of the write
  return is_take(options.endpoint) ? watch_take(options) : watch_feed(options);
}
