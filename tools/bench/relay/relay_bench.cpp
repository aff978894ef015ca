#include "bench/relay/relay_bench.h"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/child_process.h"
#include "base/exit_codes.h"
#include "base/time.h"
#include "bench/bridges/free_port.h"
#include "bench/bridges/people_feed.h"
#include "bench/program.h"
#include "bench/relay/nats_subscribers.h"
#include "bench/wait_until.h"
#include "settings/subject/marker_set_file.h"
#include "support/temporary_folder.h"
#include "wire/codec/lite.h"
#include "wire/zmq_subscriber.h"

namespace mocap::bench {
namespace {

constexpr Duration kCertificateWithin = std::chrono::seconds(60);
constexpr double kJoinWithin_s = 60.0;
constexpr double kSettle_s = 1.0;  // between the last join and the first measured frame
constexpr Duration kPatience = std::chrono::milliseconds(20);
constexpr Duration kLastFrames = std::chrono::milliseconds(1000);  // until the last frames have arrived

// A subscriber of the feed itself notes when it has which frame, until the stop.
void follow(const std::stop_token& stop, wire::ZmqSubscriber& live, Arrivals& arrivals) {
  while (!stop.stop_requested()) {
    const auto message = live.next(kPatience);
    if (!message) continue;
    wire::Lite lite;
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(message->payload.data());
    if (wire::decode_lite({bytes, message->payload.size()}, lite)) {
      arrivals.note(0, lite.number, to_ns(host_now()));
    }
  }
}

class RelayRun {
 public:
  RelayRun(const RelayBenchSettings& settings, PeopleFeed feed, std::uint16_t port)
      : settings_(settings),
        feed_(std::move(feed)),
        port_(port),
        times_{.first_ns = to_ns(host_now()), .period_ns = from_s(1.0 / settings.rate_hz).count()},
        live_(1, frames()),
        received_(static_cast<std::size_t>(settings.subscribers), frames()) {}

  Result<RelayBenchFigures> measure() {
    RelayBenchFigures figures;
    getloadavg(&figures.load, 1);
    const std::string url = fmt::format("{}://127.0.0.1:{}", settings_.tls ? "tls" : "nats", port_);
    std::vector<std::string> of_server{"-a", "127.0.0.1", "-p", std::to_string(port_)};
    std::vector<std::string> of_relay{feed_.endpoint(), "--server", url, "--status-file",
                                      folder_.path() / "status.json"};
    if (settings_.tls) {
      const auto made =
          ChildProcess::output_of({program_beside("mocap-web"), "cert", certificate()}, kCertificateWithin);
      if (!made) return made.error();
      of_server.insert(of_server.end(),
                       {"--tls", "--tlscert", certificate() + ".crt", "--tlskey", certificate() + ".key"});
      of_relay.insert(of_relay.end(), {"--ca", certificate() + ".crt"});
    }
    Program server(settings_.server, of_server);
    Program relay("mocap-relay", of_relay);
    if (!server.runs()) return missing(settings_.server.string());
    if (!relay.runs()) return missing("mocap-relay");
    auto subscribers = connect(url);
    if (!subscribers) return subscribers.error();
    auto live = wire::ZmqSubscriber::open({.endpoint = feed_.endpoint(), .topics = {"lite/*"}});
    if (!live) return live.error();
    FrameRange range;
    {
      const std::jthread following([&](const std::stop_token& stop) { follow(stop, **live, live_); });
      const auto sent = send_frames(**subscribers, relay, server, figures);
      if (!sent) return sent.error();
      range = *sent;
      std::this_thread::sleep_for(kLastFrames);
    }
    subscribers->reset();
    figures.added = compare(live_, received_, range);
    return figures;
  }

 private:
  // The files of the certificate, without .crt and .key.
  std::string certificate() const { return folder_.path() / "server"; }
  std::uint64_t count(double seconds) const {
    return static_cast<std::uint64_t>(std::ceil(seconds * settings_.rate_hz));
  }
  std::size_t frames() const { return count(kJoinWithin_s) + count(kSettle_s) + count(settings_.seconds) + 2; }

  static Error missing(const std::string& program) {
    return Error{ErrorCode::NotFound, program + " cannot be started; for the server, apt-get install nats-server"};
  }

  // The server needs a moment before it listens.
  Result<std::unique_ptr<NatsSubscribers>> connect(const std::string& url) {
    const Timestamp until = host_now() + from_s(kJoinWithin_s);
    while (true) {
      auto opened =
          NatsSubscribers::open(url, settings_.tls ? certificate() + ".crt" : "", "mocap.studio.lite.*", received_);
      if (opened || host_now() > until) return opened;
      std::this_thread::sleep_for(kPatience);
    }
  }

  // Sends frames until all subscribers have joined, and then the measured ones, which are returned.
  Result<FrameRange> send_frames(const NatsSubscribers& subscribers, Program& relay, Program& server,
                                 RelayBenchFigures& figures) {
    times_.first_ns = to_ns(host_now());
    std::uint64_t number = 1;
    for (; subscribers.joined() < static_cast<std::size_t>(settings_.subscribers); ++number) {
      if (number > count(kJoinWithin_s)) return Error{ErrorCode::Timeout, "not every subscriber got a frame in 60 s"};
      if (!relay.runs()) return missing("mocap-relay");
      if (const Status sent = send(number); !sent) return sent.error();
    }
    const FrameRange range{number + count(kSettle_s), number + count(kSettle_s) + count(settings_.seconds) - 1};
    double relay_s = 0.0, server_s = 0.0;
    Timestamp began = host_now();
    for (; number <= range.last; ++number) {
      if (number == range.first) {
        relay_s = relay.cpu_s();
        server_s = server.cpu_s();
        began = host_now();
      }
      if (const Status sent = send(number); !sent) return sent.error();
    }
    const double measured_s = to_s(host_now() - began);
    figures.relay_cpu_share = (relay.cpu_s() - relay_s) / measured_s;
    figures.server_cpu_share = (server.cpu_s() - server_s) / measured_s;
    return range;
  }

  Status send(std::uint64_t number) {
    wait_until(from_ns(times_.exposed_ns(number)));
    return feed_.send(number, times_);
  }

  const RelayBenchSettings& settings_;
  support::TemporaryFolder folder_;
  PeopleFeed feed_;
  std::uint16_t port_;
  FrameTimes times_;
  Arrivals live_, received_;
};

double received_share(const AddedFigures& added) {
  const auto all = static_cast<double>(added.frames + added.lost);
  return all > 0.0 ? static_cast<double>(added.frames) / all : 0.0;
}

}  // namespace

Result<RelayBenchFigures> run_relay_bench(const RelayBenchSettings& settings) {
  const Result<MarkerSet> set = settings::load_marker_set(settings.marker_set);
  if (!set) return set.error();
  auto feed = PeopleFeed::open(*set, settings.subjects, settings.rate_hz);
  if (!feed) return feed.error();
  const Result<std::uint16_t> port = free_port();
  if (!port) return port.error();
  return RelayRun(settings, *std::move(feed), *port).measure();
}

cli::App* add_relay_bench(cli::App& app, RelayBenchSettings& settings) {
  cli::App* relay = app.add_subcommand(
      "relay",
      "mocap-relay beside a simulated feed and a NATS server on this machine, with subscribers of the "
      "server in this process: share of the frames that a subscriber received, and the time from when a subscriber of "
      "the feed's topics lite/NAME in this process has a frame until a subscriber of the server has it. CPU: processor "
      "time per second.");
  relay->examples("  mocap-bench relay --subscribers 300 --json\n  mocap-bench relay --subscribers 300 --tls");
  relay->add_option("--seconds", settings.seconds, "measured time, s")
      ->check(cli::Range(0.5, 3600.0))
      ->capture_default_str();
  relay->add_option("--subscribers", settings.subscribers, "of the server, each with its own connection")
      ->check(cli::Range(1, 2000))
      ->capture_default_str();
  relay->add_option("--subjects", settings.subjects, "people in the feed")
      ->check(cli::Range(1, 8))
      ->capture_default_str();
  relay->add_option("--rate", settings.rate_hz, "frames a second, Hz")
      ->check(cli::Range(1.0, 30.0))
      ->capture_default_str();
  relay->add_flag("--tls", settings.tls, "all connections of the server have TLS, as beyond this machine");
  relay->add_option("--server", settings.server, "the program of the server")->capture_default_str();
  relay->add_option("--marker-set", settings.marker_set, "marker set of each person")->capture_default_str();
  return relay;
}

int print_relay_bench(const RelayBenchSettings& settings, bool json) {
  const Result<RelayBenchFigures> figures = run_relay_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  const RelayBenchFigures& f = *figures;
  constexpr double kMillisecond_us = 1e3;
  if (json) {
    fmt::print(
        "{{\"subscribers\":{},\"rate_hz\":{},\"received_share\":{:.6f},\"lost\":{},\"added_p50_ms\":{:.3f},"
        "\"added_p99_ms\":{:.3f},\"added_max_ms\":{:.3f},\"relay_cpu_share\":{:.4f},\"server_cpu_share\":{:.4f},"
        "\"load\":{:.2f}}}\n",
        settings.subscribers, settings.rate_hz, received_share(f.added), f.added.lost, f.added.p50_us / kMillisecond_us,
        f.added.p99_us / kMillisecond_us, f.added.max_us / kMillisecond_us, f.relay_cpu_share, f.server_cpu_share,
        f.load);
    return kExitOk;
  }
  fmt::print("received       {:.3f} % ({} lost)\n", 100.0 * received_share(f.added), f.added.lost);
  fmt::print("added p50      {:.2f} ms\nadded p99      {:.2f} ms\nadded max      {:.2f} ms\n",
             f.added.p50_us / kMillisecond_us, f.added.p99_us / kMillisecond_us, f.added.max_us / kMillisecond_us);
  fmt::print("CPU            relay {:.1f} %, server {:.1f} %\nload average before: {:.2f}\n", 100.0 * f.relay_cpu_share,
             100.0 * f.server_cpu_share, f.load);
  return kExitOk;
}

}  // namespace mocap::bench
