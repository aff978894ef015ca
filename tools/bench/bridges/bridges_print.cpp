#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/exit_codes.h"
#include "bench/bridges/bridges_bench.h"

namespace mocap::bench {
namespace {

nlohmann::ordered_json object_of(const BridgeFigures& f) {
  return {{"added_p50_us", f.added.p50_us}, {"added_p99_us", f.added.p99_us}, {"added_max_us", f.added.max_us},
          {"received", f.added.frames},     {"lost", f.added.lost},           {"cpu_share", f.cpu_share}};
}

double ratio(const BridgeFigures& f, const BridgeFigures& reference) {
  return reference.added.p99_us > 0.0 ? f.added.p99_us / reference.added.p99_us : 0.0;
}

void print_row(const BridgeFigures& f, double ratio) {
  fmt::print("{:<10} {:>8.0f} {:>8.0f} {:>8.0f} {:>9} {:>6} {:>6.1f} % {:>7.2f}\n", f.protocol, f.added.p50_us,
             f.added.p99_us, f.added.max_us, f.added.frames, f.added.lost, 100.0 * f.cpu_share, ratio);
}

void print_json(const BridgesBenchSettings& settings, const BridgesBenchFigures& figures) {
  nlohmann::ordered_json all{{"clients", settings.clients},
                             {"subjects", settings.subjects},
                             {"rate_hz", settings.rate_hz},
                             {"load", figures.load}};
  for (const BridgeFigures& one : figures.bridges) {
    all[one.protocol] = object_of(one);
    all[one.protocol]["ratio_reference_p99"] = ratio(one, figures.reference);
  }
  all["reference"] = object_of(figures.reference);
  fmt::print("{}\n", all.dump());
}

void print_table(const BridgesBenchFigures& figures) {
  fmt::print("added, us       p50      p99      max  received   lost      CPU  p99 / reference\n");
  for (const BridgeFigures& one : figures.bridges) print_row(one, ratio(one, figures.reference));
  print_row(figures.reference, ratio(figures.reference, figures.reference));
  fmt::print("load average before: {:.2f}\n", figures.load);
}

}  // namespace

cli::App* add_bridges_bench(cli::App& app, BridgesBenchSettings& settings) {
  cli::App* bridges = app.add_subcommand(
      "bridges",
      "Each bridge program beside a simulated feed, with receivers on loopback ports: added time, lost frames, CPU.\n"
      "added: from the time when a plain subscriber of the feed in this process has a frame until a receiver in this "
      "process has the last packet of the same frame; both times are read after the receiving call returns. NatNet has "
      "the frame's number; VRPN and Rokoko have its exposure; in VMC, which sends the first subject alone, the "
      "position of the hips counts the frames. lost: frames that the feed sent and a receiver never got, summed over "
      "the receivers. CPU: processor time of the bridge per second. The reference is a thread that sends the feed's "
      "own messages to as many UDP receivers.");
  bridges->examples(
      "  mocap-bench bridges --seconds 10 --json\n"
      "  mocap-bench bridges --only natnet --clients 1");
  bridges->add_option("--seconds", settings.seconds, "measured time for each protocol, s")
      ->check(cli::Range(0.5, 3600.0))
      ->capture_default_str();
  bridges->add_option("--clients", settings.clients, "receivers of each bridge")
      ->check(cli::Range(1, 64))
      ->capture_default_str();
  bridges->add_option("--subjects", settings.subjects, "people in the feed")
      ->check(cli::Range(1, 8))
      ->capture_default_str();
  bridges->add_option("--rate", settings.rate_hz, "frames a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  bridges->add_option("--only", settings.only, "the one protocol to measure; default: all")
      ->check(cli::IsMember{"natnet", "vrpn", "rokoko", "vmc"});
  bridges->add_option("--marker-set", settings.marker_set, "marker set of each person")->capture_default_str();
  return bridges;
}

int print_bridges_bench(const BridgesBenchSettings& settings, bool json) {
  const Result<BridgesBenchFigures> figures = run_bridges_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  json ? print_json(settings, *figures) : print_table(*figures);
  return kExitOk;
}

}  // namespace mocap::bench
