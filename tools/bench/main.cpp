#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/exit_codes.h"
#include "base/install_folders.h"
#include "base/log.h"
#include "bench/bridges/bridges_bench.h"
#include "bench/cameras/cameras_print.h"
#include "bench/detect/detect_report.h"
#include "bench/feed/feed_bench.h"
#include "bench/fuse/fuse_bench.h"
#include "bench/fuse/fuse_print.h"
#include "bench/hostile/hostile_bench.h"
#include "bench/nodes_bench.h"
#include "bench/pipeline_bench.h"
#include "bench/relay/relay_bench.h"
#include "bench/solve/solve_bench.h"
#include "bench/take_bench.h"
#include "lib/cli/app.h"

namespace mocap::bench {
namespace {

constexpr const char* kExamples = R"(examples:
  mocap-bench pipeline                          8 synthetic cameras at 120 Hz, 41 markers, as a table
  mocap-bench pipeline --json                   the same as one JSON object
  mocap-bench pipeline --cameras 4 --rate 60    the same with another size
  mocap-bench detect --size 1280x1024           blobs of 40 markers: time, and error against the Cramer-Rao bound
  mocap-bench detect --variant busy --markers 200
  mocap-bench fuse --cameras 8 --markers 40     blobs to 3D tracks in one thread, with and without predictions, as a table
  mocap-bench fuse --json                       the same as a JSON array of both modes
  mocap-bench fuse --growth                     over cameras and markers: is the cost linear in the blobs?
  mocap-bench cameras --count 8 --rate 120      8 served GigE cameras of 640x480, from packet to feed
  mocap-bench cameras --count 4 --size 1280x1024 --rate 100 --seconds 60 --json
  mocap-bench cameras --clock-skew-us 5000 --clock-drift-ppm 50 --delivery-jitter-us 2000 --warm-up 10
  mocap-bench cameras --bus v4l2 --count 2 --rate 30 --format MJPEG
  mocap-bench solve --subjects 3 --json         labels and skeletons of three walking people, against Ceres
  mocap-bench feed --subscribers 200 --rate 120 --seconds 5 --json
                                                received share, age and cost of the snapshots
  mocap-bench take --seconds 60 --json          a take beside 20 subscribers: losses, size; tracked again
  mocap-bench bridges --json                    what each bridge adds to the feed's latency, with 10 receivers
  mocap-bench relay --json                      300 subscribers of a NATS server to which mocap-relay sends
  mocap-bench hostile --json                    worst gap of a subscriber while hostile peers attack)";

void print_pipeline(const PipelineBenchFigures& f, bool json) {
  if (json) {
    const nlohmann::json object{{"sets", f.sets},
                                {"complete_share", f.complete_share},
                                {"p50_us", f.p50_us},
                                {"p99_us", f.p99_us},
                                {"max_us", f.max_us},
                                {"dropped", f.dropped},
                                {"allocations", f.allocations},
                                {"labelled_share", f.labelled_share}};
    fmt::print("{}\n", object.dump());
    return;
  }
  fmt::print("sets           {}\ncomplete       {:.2f} %\nlabelled       {:.2f} %\n", f.sets, 100.0 * f.complete_share,
             100.0 * f.labelled_share);
  fmt::print("latency p50    {:.0f} us\nlatency p99    {:.0f} us\nlatency max    {:.0f} us\n", f.p50_us, f.p99_us,
             f.max_us);
  fmt::print("dropped        {}\nallocations    {}\n", f.dropped, f.allocations);
}

int pipeline(const PipelineBenchSettings& settings, bool json) {
  const Result<PipelineBenchFigures> figures = run_pipeline_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  print_pipeline(*figures, json);
  return kExitOk;
}

void add_pipeline_options(cli::App& pipeline, PipelineBenchSettings& settings) {
  pipeline.add_option("--cameras", settings.cameras, "synthetic cameras in a ring")
      ->check(cli::Range(2, 64))
      ->capture_default_str();
  pipeline.add_option("--rate", settings.rate_hz, "images a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  pipeline.add_option("--seconds", settings.seconds, "measured time, s")
      ->check(cli::Range(0.5, 3600.0))
      ->capture_default_str();
  pipeline.add_option("--marker-set", settings.marker_set, "marker set of the subject")->capture_default_str();
  pipeline.add_option("--seed", settings.seed, "seed of the image noise")->capture_default_str();
}

void add_detect_options(cli::App& detect, simworld::DetectSceneSettings& settings) {
  detect
      .add_option(
          "--size",
          [&settings](const std::string& size) -> std::optional<std::string> {
            int end = 0;
            const int read = std::sscanf(size.c_str(), "%dx%d%n", &settings.width_px, &settings.height_px, &end);
            const bool fits = read == 2 && static_cast<std::size_t>(end) == size.size() && settings.width_px >= 64 &&
                              settings.height_px >= 64 && settings.width_px <= 16384 && settings.height_px <= 16384;
            if (!fits) return size + ", expected WxH, each 64 to 16384";
            return std::nullopt;
          },
          "image size, px, such as 1280x1024 (the default)")
      ->type_name("WxH");
  detect.add_option("--markers", settings.markers, "markers in an image")
      ->check(cli::Range(1, 512))
      ->capture_default_str();
  detect.add_choice("--variant", settings.busy, {{"dark", false}, {"busy", true}}, "dark, or busy with bright clutter");
  detect
      .add_option("--peak", settings.peak_grey,
                  "peak of a marker above the background, grey levels; saturates above 240")
      ->check(cli::Range(30.0, 2000.0))
      ->capture_default_str();
  detect.add_option("--noise", settings.noise_grey, "standard deviation, grey levels")
      ->check(cli::Range(0.0, 30.0))
      ->capture_default_str();
  detect.add_option("--seed", settings.seed, "seed of positions and noise")->capture_default_str();
}

void add_fuse_options(cli::App& fuse, FuseBenchSettings& settings, bool& growth) {
  fuse.add_option("--cameras", settings.world.cameras, "in a ring")->check(cli::Range(2, 64))->capture_default_str();
  fuse.add_option("--markers", settings.world.markers, "markers on walking people")
      ->check(cli::Range(1, 320))
      ->capture_default_str();
  fuse.add_option("--sets", settings.sets, "measured")->check(cli::Range(10, 1000000))->capture_default_str();
  fuse.add_option("--rate", settings.world.rate_hz, "sets a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  fuse.add_option("--missed", settings.world.missed, "share of a marker's views without a blob")
      ->check(cli::Range(0.0, 0.9))
      ->capture_default_str();
  fuse.add_option("--false-blobs", settings.world.false_blobs, "false blobs for each marker and image")
      ->check(cli::Range(0.0, 1.0))
      ->capture_default_str();
  fuse.add_option("--sigma", settings.world.sigma_px, "standard deviation of a blob centroid, px")
      ->check(cli::Range(0.0, 2.0))
      ->capture_default_str();
  fuse.add_option("--seed", settings.world.seed, "seed of noise, misses and false blobs")->capture_default_str();
  fuse.add_flag("--growth", growth,
                "run several numbers of cameras and markers and print the growth exponent of the cost with the blobs");
}

void add_solve_options(cli::App& solve, SolveBenchSettings& settings) {
  solve.add_option("--subjects", settings.subjects, "walking people")->check(cli::Range(1, 6))->capture_default_str();
  solve.add_option("--sets", settings.sets, "measured")->check(cli::Range(10, 1000000))->capture_default_str();
  solve.add_option("--rate", settings.rate_hz, "sets a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  solve.add_option("--marker-set", settings.marker_set, "marker set of each person")->capture_default_str();
  solve.add_option("--seed", settings.seed, "seed of noise and false blobs")->capture_default_str();
}

int fuse(FuseBenchSettings settings, bool json, bool growth) {
  std::vector<std::pair<int, int>> sizes{{settings.world.cameras, settings.world.markers}};
  if (growth)
    sizes = {{4, 40}, {8, 20}, {8, 40}, {8, 80}, {8, 160}, {16, 40}, {16, 160}, {32, 160}, {64, 40}, {64, 300}};
  std::vector<FuseBenchFigures> all;
  for (const auto& [cameras, markers] : sizes) {
    settings.world.cameras = cameras;
    settings.world.markers = markers;
    const auto figures = run_fuse_bench(settings);
    if (!figures) {
      fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
      return kExitConfig;
    }
    all.insert(all.end(), figures->begin(), figures->end());
  }
  fmt::print("{}", json ? fuse_json(all) + "\n" : fuse_table(all));
  return kExitOk;
}

int solve(const SolveBenchSettings& settings, bool json) {
  const Result<SolveBenchFigures> figures = run_solve_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitConfig;
  }
  const SolveBenchFigures& f = *figures;
  if (json) {
    const nlohmann::json object{{"subjects", f.subjects},       {"markers", f.markers},
                                {"median_us", f.median_us},     {"p99_us", f.p99_us},
                                {"max_us", f.max_us},           {"p99_over_median", f.p99_over_median},
                                {"label_us", f.label_us},       {"solve_us", f.solve_us},
                                {"ceres_us", f.ceres_us},       {"speedup_ceres", f.speedup_ceres},
                                {"right_share", f.right_share}, {"tracked_share", f.tracked_share}};
    fmt::print("{}\n", object.dump());
    return kExitOk;
  }
  fmt::print("subjects       {} ({} markers)\nmedian         {:.1f} us (label {:.1f}, solve {:.1f})\n", f.subjects,
             f.markers, f.median_us, f.label_us, f.solve_us);
  fmt::print("p99            {:.1f} us, {:.1f} times the median\nmax            {:.1f} us\n", f.p99_us,
             f.p99_over_median, f.max_us);
  fmt::print("Ceres          {:.0f} us for the poses alone, {:.1f} times our solver\n", f.ceres_us, f.speedup_ceres);
  fmt::print("right labels   {:.2f} %\ntracked        {:.2f} %\n", 100.0 * f.right_share, 100.0 * f.tracked_share);
  return kExitOk;
}

// The settings of all benches.
struct Benches {
  bool json = false;
  bool growth = false;
  PipelineBenchSettings pipeline;
  simworld::DetectSceneSettings detect;
  FuseBenchSettings fuse;
  SolveBenchSettings solve;
  CamerasBenchSettings cameras;
  FeedBenchSettings feed;
  TakeBenchSettings take;
  BridgesBenchSettings bridges;
  NodesBenchSettings nodes;
  HostileBenchSettings hostile;
  RelayBenchSettings relay;

  explicit Benches(const std::string& marker_set) {
    const auto set = [&](auto&... each) { ((each = marker_set), ...); };
    set(pipeline.marker_set, fuse.marker_set, solve.marker_set, cameras.marker_set, take.scene.marker_set,
        bridges.marker_set, nodes.marker_set, relay.marker_set);
  }
};

struct Command {
  cli::App* app;
  std::function<int()> run;
};

Command pipeline_command(cli::App& app, Benches& all) {
  cli::App* pipeline = app.add_subcommand("pipeline", "latency from the last blob of a set to the snapshot at ZeroMQ");
  pipeline->examples("  mocap-bench pipeline --cameras 8 --rate 120 --seconds 10");
  add_pipeline_options(*pipeline, all.pipeline);
  return {pipeline, [&all] { return bench::pipeline(all.pipeline, all.json); }};
}

Command detect_command(cli::App& app, Benches& all) {
  cli::App* detect = app.add_subcommand("detect", "detection in images in memory: time and precision");
  detect->examples(
      "  mocap-bench detect --size 1280x1024 --markers 40\n"
      "  mocap-bench detect --variant busy --json");
  add_detect_options(*detect, all.detect);
  return {detect, [&all] { return bench::detect(all.detect, all.json); }};
}

Command fuse_command(cli::App& app, Benches& all) {
  cli::App* fuse = app.add_subcommand("fuse", "time for a set from blobs to 3D tracks, against OpenCV, in one thread");
  fuse->examples(
      "  mocap-bench fuse --cameras 8 --markers 40\n"
      "  mocap-bench fuse --growth --json");
  add_fuse_options(*fuse, all.fuse, all.growth);
  return {fuse, [&all] { return bench::fuse(all.fuse, all.json, all.growth); }};
}

Command cameras_command(cli::App& app, Benches& all) {
  cli::App* cameras =
      app.add_subcommand("cameras", "cameras with real packets and drivers: lost images, CPU time, exposure times");
  cameras->examples(
      "  mocap-bench cameras --count 8 --rate 120\n"
      "  mocap-bench cameras --bus v4l2 --count 2 --rate 30 --format MJPEG");
  add_cameras_options(*cameras, all.cameras);
  return {cameras, [&all] { return bench::cameras(all.cameras, all.json); }};
}

Command solve_command(cli::App& app, Benches& all) {
  cli::App* solve = app.add_subcommand("solve", "time for labels and skeletons of a set");
  solve->examples("  mocap-bench solve --subjects 3 --json");
  add_solve_options(*solve, all.solve);
  return {solve, [&all] { return bench::solve(all.solve, all.json); }};
}

int hostile(const Benches& all) {
  set_log_level(LogLevel::Error);  // the effects of the attacks are printed as figures
  return print_hostile_bench(all.hostile, all.json);
}

std::vector<Command> add_commands(cli::App& app, Benches& all) {
  std::vector<Command> commands = {pipeline_command(app, all), detect_command(app, all), fuse_command(app, all),
                                   cameras_command(app, all), solve_command(app, all)};
  commands.push_back({add_feed_bench(app, all.feed), [&all] { return print_feed_bench(all.feed, all.json); }});
  commands.push_back({add_take_bench(app, all.take), [&all] { return print_take_bench(all.take, all.json); }});
  commands.push_back(
      {add_bridges_bench(app, all.bridges), [&all] { return print_bridges_bench(all.bridges, all.json); }});
  commands.push_back({add_nodes_bench(app, all.nodes), [&all] { return print_nodes_bench(all.nodes, all.json); }});
#ifdef MOCAP_HAS_NATS
  commands.push_back({add_relay_bench(app, all.relay), [&all] { return print_relay_bench(all.relay, all.json); }});
#endif
  commands.push_back({add_hostile_bench(app, all.hostile), [&all] { return hostile(all); }});
  for (const Command& command : commands) {
    const bool array = command.app->get_name() == "fuse";
    command.app->add_flag("--json", all.json,
                          array ? "one JSON array on standard output" : "one JSON object on standard output");
  }
  return commands;
}

}  // namespace
}  // namespace mocap::bench

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  cli::App app{"mocap-bench: time and memory of the daemon's parts on this machine", "mocap-bench"};
  app.footer(bench::kExamples);
  app.require_subcommand(1);
  bench::Benches all((install_folders().data / "markersets" / "baseline41.toml").string());
  const std::vector<bench::Command> commands = bench::add_commands(app, all);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  set_log_level(LogLevel::Warn);
  for (const bench::Command& command : commands) {
    if (command.app->parsed()) return command.run();
  }
  return kExitUsage;
}
