#include "bench/hostile/hostile_bench.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "base/exit_codes.h"
#include "base/time.h"
#include "bench/hostile/hostile_attacks.h"
#include "support/typical_snapshot.h"
#include "wire/codec/decode.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace mocap::bench {
namespace {

using std::chrono::milliseconds;

void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// Runs the feed in a child process until a signal ends it. Writes the port to `port_pipe`.
[[noreturn]] void serve(double rate_hz, int port_pipe) {
  const Description description = support::typical_description();
  Snapshot snapshot = support::typical_snapshot(description);
  auto publisher = wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  if (!publisher || !(*publisher)->describe(description)) ::_exit(1);
  const std::string& endpoint = (*publisher)->endpoint();
  const auto port = static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  if (::write(port_pipe, &port, sizeof(port)) != sizeof(port)) ::_exit(1);
  Health health;
  const Duration period = from_s(1.0 / rate_hz);
  Timestamp next = host_now();
  Timestamp reported = next;
  for (;;) {
    std::this_thread::sleep_until(next += period);
    next = std::max(next, host_now() - period);  // skip missed periods
    ++snapshot.number;
    const Timestamp handed = host_now();
    static_cast<void>((*publisher)->publish(snapshot));
    const Timestamp done = host_now();
    LatencyFigures& publishing = health.latency[static_cast<std::size_t>(LatencyStage::Send)];
    ++publishing.count;
    publishing.max = std::max(publishing.max, done - handed);
    if (done - reported < milliseconds(250)) continue;
    reported = done;
    health.feed = (*publisher)->feed();
    static_cast<void>((*publisher)->report(health));
    publishing = {};
  }
}

class FeedProcess {
 public:
  static Result<std::unique_ptr<FeedProcess>> start(double rate_hz) {
    int ends[2];
    if (::pipe(ends) != 0) return Error{ErrorCode::Io, "no pipe"};
    const pid_t process = ::fork();
    if (process < 0) return Error{ErrorCode::Io, "cannot fork"};
    if (process == 0) {
      ::close(ends[0]);
      serve(rate_hz, ends[1]);
    }
    ::close(ends[1]);
    auto made = std::make_unique<FeedProcess>();
    made->process_ = process;
    const bool has_port = ::read(ends[0], &made->port_, sizeof(made->port_)) == sizeof(made->port_);
    ::close(ends[0]);
    if (!has_port) return Error{ErrorCode::Io, "the feed did not start"};
    return made;
  }
  ~FeedProcess() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  std::uint16_t port() const { return port_; }
  bool alive() { return ::waitpid(process_, nullptr, WNOHANG) == 0; }
  double resident_mb() const {
    std::ifstream status("/proc/" + std::to_string(process_) + "/statm");
    double pages = 0.0, resident = 0.0;
    status >> pages >> resident;
    return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
  }

 private:
  pid_t process_ = -1;
  std::uint16_t port_ = 0;
};

// A well-behaved subscriber that also samples the memory of the feed.
class Witness {
 public:
  explicit Witness(FeedProcess& feed) : feed_(feed) {
    wire::SubscriberSettings settings;
    settings.endpoint = "tcp://127.0.0.1:" + std::to_string(feed.port());
    subscriber_ = std::move(*wire::ZmqSubscriber::open(settings));
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  void begin() {
    worst_gap_ns_ = 0;
    most_mb_ = 0.0;
    publish_max_ms_ = 0.0;
    most_behind_ = 0;
  }
  // Includes the current gap.
  double worst_gap_ms() const {
    return 1e-6 * static_cast<double>(std::max(worst_gap_ns_.load(), to_ns(host_now()) - last_ns_.load()));
  }
  double most_mb() const { return most_mb_; }
  double publish_max_ms() const { return publish_max_ms_; }
  std::uint32_t most_behind() const { return most_behind_; }
  bool hears() const { return last_ns_ != 0; }
  FeedHealth health() const {
    const std::lock_guard lock(mutex_);
    return health_;
  }

 private:
  void run(const std::stop_token& stop) {
    Timestamp looked{};
    while (!stop.stop_requested()) {
      const Result<wire::FeedMessage> message = subscriber_->next(milliseconds(20));
      const Timestamp now = host_now();
      if (now - looked > milliseconds(50)) {
        looked = now;
        most_mb_ = std::max(most_mb_.load(), feed_.resident_mb());
      }
      if (!message) continue;
      if (message->topic == "health") learn(message->payload);
      if (message->topic != "snapshot") continue;
      const std::int64_t last = last_ns_.exchange(to_ns(now));
      if (last != 0) worst_gap_ns_ = std::max(worst_gap_ns_.load(), to_ns(now) - last);
    }
  }
  void learn(const std::string& payload) {
    v1::Health message;
    if (!message.ParseFromString(payload)) return;
    const Result<Health> health = wire::decode(message);
    const std::lock_guard lock(mutex_);
    if (!health) return;
    health_ = health->feed;
    most_behind_ = std::max(most_behind_.load(), health_.behind);
    const Duration publishing = health->latency[static_cast<std::size_t>(LatencyStage::Send)].max;
    publish_max_ms_ = std::max(publish_max_ms_.load(), 1e3 * to_s(publishing));
  }

  FeedProcess& feed_;
  std::unique_ptr<wire::ZmqSubscriber> subscriber_;
  std::atomic<std::int64_t> last_ns_{0};
  std::atomic<std::int64_t> worst_gap_ns_{0};
  std::atomic<double> most_mb_{0.0};
  std::atomic<double> publish_max_ms_{0.0};
  std::atomic<std::uint32_t> most_behind_{0};
  mutable std::mutex mutex_;
  FeedHealth health_;
  std::jthread thread_;
};

FeedHealth growth(const FeedHealth& before, const FeedHealth& after) {
  FeedHealth by;
  by.listeners = after.listeners;
  by.connections = after.connections - before.connections;
  by.disconnections = after.disconnections - before.disconnections;
  by.failed_handshakes = after.failed_handshakes - before.failed_handshakes;
  by.cut_off = after.cut_off - before.cut_off;
  by.failed_accepts = after.failed_accepts - before.failed_accepts;
  return by;
}

void settle() { std::this_thread::sleep_for(milliseconds(600)); }  // longer than two health reports of the feed

}  // namespace

Result<HostileBenchFigures> run_hostile_bench(const HostileBenchSettings& settings) {
  raise_descriptor_limit();
  auto feed = FeedProcess::start(settings.rate_hz);  // fork before this process has threads
  if (!feed) return feed.error();
  Witness witness(**feed);
  const Timestamp begun = host_now();
  while (!witness.hears()) {
    if (host_now() - begun > std::chrono::seconds(10)) return Error{ErrorCode::Timeout, "the feed sends nothing"};
    std::this_thread::sleep_for(milliseconds(10));
  }
  settle();
  HostileBenchFigures figures;
  witness.begin();
  std::this_thread::sleep_for(from_s(settings.seconds));
  figures.quiet_gap_ms = witness.worst_gap_ms();
  const double quiet_mb = witness.most_mb();
  for (const char* name : kAttacks) {
    const FeedHealth before = witness.health();
    witness.begin();
    {
      const auto attack = make_attack(name, (*feed)->port(), settings.seed);
      attack->go_on(host_now() + from_s(settings.seconds));
      settle();
    }
    AttackFigures& attack_figures = figures.attacks.emplace_back();
    attack_figures = {name, witness.worst_gap_ms(), witness.publish_max_ms(), witness.most_mb() - quiet_mb,
                      growth(before, witness.health())};
    attack_figures.counted.behind = witness.most_behind();
    figures.worst_gap_ms = std::max(figures.worst_gap_ms, figures.attacks.back().worst_gap_ms);
    figures.growth_mb = std::max(figures.growth_mb, figures.attacks.back().growth_mb);
    settle();
  }
  figures.alive = (*feed)->alive();
  return figures;
}

cli::App* add_hostile_bench(cli::App& app, HostileBenchSettings& settings) {
  cli::App* hostile = app.add_subcommand(
      "hostile", "the feed with hostile peers that stall, flood and send malformed data: gaps, memory");
  hostile->examples("  mocap-bench hostile --seconds 2 --json");
  hostile->add_option("--rate", settings.rate_hz, "snapshot rate, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  hostile->add_option("--seconds", settings.seconds, "duration of each attack, s")
      ->check(cli::Range(0.5, 600.0))
      ->capture_default_str();
  hostile->add_option("--seed", settings.seed, "seed of the random bytes")->capture_default_str();
  return hostile;
}

int print_hostile_bench(const HostileBenchSettings& settings, bool json) {
  const Result<HostileBenchFigures> figures = run_hostile_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  auto attacks = nlohmann::ordered_json::array();
  for (const AttackFigures& a : figures->attacks) {
    attacks.push_back({{"name", a.name},
                       {"worst_gap_ms", a.worst_gap_ms},
                       {"publish_max_ms", a.publish_max_ms},
                       {"growth_mb", a.growth_mb},
                       {"listeners", a.counted.listeners},
                       {"connections", a.counted.connections},
                       {"failed_handshakes", a.counted.failed_handshakes},
                       {"cut_off", a.counted.cut_off},
                       {"disconnections", a.counted.disconnections},
                       {"failed_accepts", a.counted.failed_accepts},
                       {"behind", a.counted.behind}});
    if (!json) {
      fmt::print(
          "{:20} worst gap {:7.1f} ms, growth {:6.1f} MB, connections {}, ended {}, failed handshakes {}, "
          "cut off {}, behind {}\n",
          a.name, a.worst_gap_ms, a.growth_mb, a.counted.connections, a.counted.disconnections,
          a.counted.failed_handshakes, a.counted.cut_off, a.counted.behind);
    }
  }
  if (json) {
    const nlohmann::ordered_json object{{"worst_gap_ms", figures->worst_gap_ms},
                                        {"quiet_gap_ms", figures->quiet_gap_ms},
                                        {"growth_mb", figures->growth_mb},
                                        {"alive", figures->alive},
                                        {"attacks", attacks}};
    fmt::print("{}\n", object.dump());
  } else {
    fmt::print("without an attack    worst gap {:7.1f} ms\nalive                {}\n", figures->quiet_gap_ms,
               figures->alive);
  }
  return figures->alive ? kExitOk : kExitSoftware;
}

}  // namespace mocap::bench
