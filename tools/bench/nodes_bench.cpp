#include "bench/nodes_bench.h"

#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/exit_codes.h"
#include "bench/at_share.h"
#include "cameras/node/node_settings.h"
#include "fusion/fusion.h"
#include "lib/simworld/fuse_world.h"
#include "lib/thread_time.h"
#include "settings/subject/marker_set_file.h"
#include "wire/zmq_node_server.h"

namespace mocap::bench {
namespace {

constexpr Duration kWarmUp = std::chrono::seconds(3);  // connections, clocks, predictions
constexpr std::uint64_t kComputedSets = 120;           // played forwards and backwards, so that no marker jumps

using ComputedSets = std::vector<std::vector<Blobs>>;  // by set, by camera

ComputedSets compute(simworld::FuseWorld& world) {
  ComputedSets sets;
  for (std::uint64_t i = 0; i < kComputedSets; ++i) {
    world.step(i);
    std::vector<Blobs>& set = sets.emplace_back();
    for (const auto& frame : world.frames()) set.push_back(frame->blobs);
  }
  return sets;
}

std::uint64_t played(std::uint64_t number) {
  const std::uint64_t period = 2 * (kComputedSets - 1);
  const std::uint64_t phase = number % period;
  return phase < kComputedSets ? phase : period - phase;
}

// Sends the blobs of some cameras at a constant rate.
class ComputedNode {
 public:
  static Result<std::unique_ptr<ComputedNode>> open(const std::string& name) {
    wire::NodeServerSettings settings;
    settings.node.endpoint = "tcp://127.0.0.1:*";
    settings.node.name = name;
    auto server = wire::ZmqNodeServer::open(settings);
    if (!server) return server.error();
    auto node = std::make_unique<ComputedNode>();
    node->server_ = *std::move(server);
    return node;
  }

  const std::string& endpoint() const { return server_->endpoints().front(); }
  std::uint64_t sent() const { return sent_.load(); }

  // The cameras `first` to `first` + `count` of the rig, which outlives the node like the sets.
  void start(const ComputedSets& sets, const Rig& rig, std::size_t first, std::size_t count, double rate_hz,
             Timestamp epoch) {
    thread_ = std::jthread([=, this, &sets, &rig](const std::stop_token& stop) {
      std::vector<NodeCamera> cameras;
      for (std::size_t i = first; i < first + count; ++i) {
        cameras.push_back({rig[i].name, static_cast<std::uint32_t>(rig[i].width_px),
                           static_cast<std::uint32_t>(rig[i].height_px), NodeCameraState::Delivering});
      }
      for (std::uint64_t number = 0; !stop.stop_requested(); ++number) {
        const Timestamp exposed_at = epoch + from_s(static_cast<double>(number) / rate_hz);
        while (host_now() < exposed_at) server_->serve(cameras, exposed_at - host_now());
        send_set(sets[played(number)], number, exposed_at, first, count);
      }
    });
  }

 private:
  void send_set(const std::vector<Blobs>& set, std::uint64_t number, Timestamp exposed_at, std::size_t first,
                std::size_t count) {
    BlobFrame frame;
    frame.number = number;
    frame.exposed_at = frame.received_at = frame.detected_at = exposed_at;
    for (std::uint32_t i = 0; i < count; ++i) {
      frame.camera = CameraId{i};
      frame.blobs = set[first + i];
      if (server_->send(frame) == NodeSend::Done) ++sent_;
    }
  }

  std::unique_ptr<wire::ZmqNodeServer> server_;
  std::atomic<std::uint64_t> sent_{0};
  std::jthread thread_;  // the last member, ends first
};

// Forwards each call and records the time from the exposure to ZeroMQ.
class TimedPublisher : public Publisher {
 public:
  TimedPublisher(std::unique_ptr<Publisher> real, std::vector<double>& spans_us, const std::atomic<bool>& measuring)
      : real_(std::move(real)), spans_us_(spans_us), measuring_(measuring) {}
  Status describe(const Description& description) override { return real_->describe(description); }
  Status report(const Health& health) override { return real_->report(health); }
  Status publish(Snapshot& snapshot) override {
    Status sent = real_->publish(snapshot);
    if (measuring_ && sent) spans_us_.push_back(to_us(*snapshot.instants.sent_at - snapshot.instants.exposed_at));
    return sent;
  }

 private:
  std::unique_ptr<Publisher> real_;
  std::vector<double>& spans_us_;
  const std::atomic<bool>& measuring_;
};

// Forwards each call and records the processor time of the fusion thread from the end of one solution to the next: all
// work of a set, also the collection of its images.
class TimedSolver : public SkeletonSolver {
 public:
  TimedSolver(std::unique_ptr<SkeletonSolver> real, std::vector<double>& spans_ms, const std::atomic<bool>& measuring)
      : real_(std::move(real)), spans_ms_(spans_ms), measuring_(measuring) {}
  const SolvedSubjects& solve(const Labels& labels, Timestamp at, std::span<const LabelledBearing> bearings,
                              std::span<const AmbiguousObservation> ambiguous) override {
    const SolvedSubjects& solved = real_->solve(labels, at, bearings, ambiguous);
    const Duration now = thread_time();
    if (measuring_) spans_ms_.push_back(1e3 * to_s(now - last_));
    last_ = now;
    return solved;
  }
  void refit(const SubjectFit& fit) override { real_->refit(fit); }
  const PredictedMarkers& predict(Timestamp at) override { return real_->predict(at); }

 private:
  std::unique_ptr<SkeletonSolver> real_;
  std::vector<double>& spans_ms_;
  const std::atomic<bool>& measuring_;
  Duration last_{};
};

// Processor time of the threads of this process by their name, s.
std::map<std::string, double> cpu_by_thread() {
  std::map<std::string, double> seconds;
  std::error_code ignored;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    std::string name, line;
    std::ifstream(task.path() / "comm") >> name;
    double run_ns = 0.0;
    std::ifstream(task.path() / "schedstat") >> run_ns;
    if (name.starts_with("mocap-cam")) name = "mocap-cam";
    if (name.starts_with("ZMQbg")) name = "ZMQbg";
    seconds[name] += 1e-9 * run_ns;
  }
  return seconds;
}

settings::DaemonSettings host_of(const NodesBenchSettings& wanted, const Rig& rig,
                                 const std::vector<std::unique_ptr<ComputedNode>>& nodes) {
  settings::DaemonSettings settings;
  settings.rig = rig;
  settings.simulated.resize(rig.size());
  for (std::size_t i = 0; i < rig.size(); ++i) {
    cameras::NodeCameraSettings camera;
    camera.endpoint = nodes[i / static_cast<std::size_t>(wanted.cameras)]->endpoint();
    settings.cameras.push_back({rig[i].name, camera});
  }
  settings.nominal_rate_hz = wanted.rate_hz;
  settings.publish.endpoint = "tcp://127.0.0.1:*";
  settings.control.endpoint = "none";
  return settings;
}

struct Counts {
  std::uint64_t sets = 0, complete = 0, skipped = 0, images = 0, sent = 0, dropped = 0;
  std::map<std::string, double> cpu_s;
};

Counts counts_of(const runtime::Pipeline& pipeline, const std::vector<std::unique_ptr<ComputedNode>>& nodes) {
  Counts counts;
  counts.sets = pipeline.fusion_counters().sets.read();
  counts.complete = pipeline.fusion_counters().complete_sets.read();
  counts.skipped = pipeline.fusion_counters().passed_over_sets.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    counts.images += pipeline.camera_counters(CameraId{i}).frames.read();
    counts.dropped += pipeline.camera_counters(CameraId{i}).dropped_queue_full.read();
  }
  for (const auto& node : nodes) counts.sent += node->sent();
  counts.cpu_s = cpu_by_thread();
  return counts;
}

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

NodesBenchFigures figures_of(Counts before, Counts after, double seconds) {
  NodesBenchFigures figures;
  figures.sets = after.sets - before.sets;
  figures.complete_share = share(after.complete - before.complete, figures.sets);
  const std::uint64_t fused = figures.sets - (after.skipped - before.skipped);
  figures.fused_share = share(fused, figures.sets);
  const std::uint64_t sent = after.sent - before.sent, received = after.images - before.images;
  figures.lost_image_share = sent > received ? share(sent - received, sent) : 0.0;
  figures.dropped_image_share = share(after.dropped - before.dropped, sent);
  const auto cpu_s = [&](const char* thread) { return after.cpu_s[thread] - before.cpu_s[thread]; };
  if (fused > 0) figures.fusion_cpu_ms = 1e3 * cpu_s("mocap-fusion") / static_cast<double>(fused);
  figures.host_cpu_share = (cpu_s("mocap-fusion") + cpu_s("mocap-cam") + cpu_s("mocap-publish")) / seconds;
  figures.link_cpu_share = cpu_s("ZMQbg") / seconds;
  return figures;
}

void wait_for(Duration span) {
  WakeSignal nobody_calls;
  nobody_calls.wait(nobody_calls.ticket(), span);
}

}  // namespace

Result<NodesBenchFigures> run_nodes_bench(const NodesBenchSettings& wanted) {
  const Result<MarkerSet> marker_set = settings::load_marker_set(wanted.marker_set);
  if (!marker_set) return marker_set.error();
  simworld::FuseWorld world(
      {.cameras = wanted.nodes * wanted.cameras, .markers = wanted.markers, .rate_hz = wanted.rate_hz}, *marker_set);
  const ComputedSets sets = compute(world);
  std::vector<std::unique_ptr<ComputedNode>> nodes;
  for (int i = 0; i < wanted.nodes; ++i) {
    auto node = ComputedNode::open("node" + std::to_string(i + 1));
    if (!node) return node.error();
    nodes.push_back(*std::move(node));
  }
  const settings::DaemonSettings host = host_of(wanted, world.rig(), nodes);
  Result<Assembly> assembly = assemble(host);
  if (!assembly) return assembly.error();
  std::vector<double> spans_us;
  spans_us.reserve(static_cast<std::size_t>(wanted.rate_hz * (wanted.seconds + 2.0)));
  std::atomic<bool> measuring{false};
  assembly->parts.publisher =
      std::make_unique<TimedPublisher>(std::move(assembly->parts.publisher), spans_us, measuring);
  std::vector<double> fusion_ms;
  fusion_ms.reserve(spans_us.capacity());
  fusion::FusionParts parts = assemble_fusion_parts(host);
  parts.solver = std::make_unique<TimedSolver>(std::move(parts.solver), fusion_ms, measuring);
  assembly->parts.fusion =
      std::make_unique<fusion::Fusion>(std::move(parts), static_cast<std::uint32_t>(host.rig.size()));
  const Timestamp epoch = host_now();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto cameras = static_cast<std::size_t>(wanted.cameras);
    nodes[i]->start(sets, world.rig(), i * cameras, cameras, wanted.rate_hz, epoch);
  }
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));

  wait_for(kWarmUp);
  const Counts before = counts_of(pipeline, nodes);
  measuring = true;
  wait_for(from_s(wanted.seconds));
  measuring = false;
  NodesBenchFigures figures = figures_of(before, counts_of(pipeline, nodes), wanted.seconds);
  pipeline.stop();
  if (figures.sets == 0) return Error{ErrorCode::Timeout, "no set came; is the machine too slow for these cameras?"};
  std::size_t blobs = 0;
  for (const auto& set : sets) {
    for (const Blobs& view : set) blobs += view.size();
  }
  figures.blobs_per_set = static_cast<double>(blobs) / static_cast<double>(sets.size());
  figures.fusion_cpu_p99_ms = at_share(fusion_ms, 0.99);
  figures.exposed_to_sent_p50_us = at_share(spans_us, 0.50);
  figures.exposed_to_sent_p99_us = at_share(spans_us, 0.99);
  return figures;
}

cli::App* add_nodes_bench(cli::App& app, NodesBenchSettings& settings) {
  cli::App* nodes =
      app.add_subcommand("nodes", "a fusion host that receives blobs of camera nodes: cost, complete sets");
  nodes->examples(
      "  mocap-bench nodes --nodes 8 --cameras 8 --markers 300 --json\n"
      "  mocap-bench nodes --nodes 2 --cameras 4 --markers 40");
  nodes->add_option("--nodes", settings.nodes, "in this process")->check(cli::Range(1, 16))->capture_default_str();
  nodes->add_option("--cameras", settings.cameras, "of each node; at most 64 of all")
      ->check(cli::Range(1, 64))
      ->capture_default_str();
  nodes->add_option("--markers", settings.markers, "of all people")->check(cli::Range(1, 500))->capture_default_str();
  nodes->add_option("--rate", settings.rate_hz, "sets a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  nodes->add_option("--seconds", settings.seconds, "of the measurement, s")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
  return nodes;
}

int print_nodes_bench(const NodesBenchSettings& settings, bool json) {
  if (const int all = settings.nodes * settings.cameras; all < 2 || all > static_cast<int>(kMaxCameras)) {
    fmt::print(stderr, "mocap-bench: {} nodes of {} cameras are {} cameras, expected 2 to {}\n", settings.nodes,
               settings.cameras, all, kMaxCameras);
    return kExitUsage;
  }
  const Result<NodesBenchFigures> figures = run_nodes_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  const NodesBenchFigures& f = *figures;
  if (json) {
    const nlohmann::ordered_json object{{"sets", f.sets},
                                        {"complete_share", f.complete_share},
                                        {"fused_share", f.fused_share},
                                        {"lost_image_share", f.lost_image_share},
                                        {"dropped_image_share", f.dropped_image_share},
                                        {"blobs_per_set", f.blobs_per_set},
                                        {"fusion_cpu_ms", f.fusion_cpu_ms},
                                        {"fusion_cpu_p99_ms", f.fusion_cpu_p99_ms},
                                        {"host_cpu_share", f.host_cpu_share},
                                        {"link_cpu_share", f.link_cpu_share},
                                        {"exposed_to_sent_p50_us", f.exposed_to_sent_p50_us},
                                        {"exposed_to_sent_p99_us", f.exposed_to_sent_p99_us}};
    fmt::print("{}\n", object.dump());
    return kExitOk;
  }
  fmt::print(
      "sets      {}, {:.2f} % complete, {:.2f} % fused; {:.3f} % of the images lost, {:.3f} % dropped by the host\n",
      f.sets, 100.0 * f.complete_share, 100.0 * f.fused_share, 100.0 * f.lost_image_share,
      100.0 * f.dropped_image_share);
  fmt::print(
      "cost      {:.2f} ms of processor time a set in the fusion thread (p99 {:.2f} ms), {:.0f} blobs a set; host "
      "{:.2f} cores, ZeroMQ {:.2f} cores\n",
      f.fusion_cpu_ms, f.fusion_cpu_p99_ms, f.blobs_per_set, f.host_cpu_share, f.link_cpu_share);
  fmt::print("latency   exposure to ZeroMQ p50 {:.0f} us, p99 {:.0f} us\n", f.exposed_to_sent_p50_us,
             f.exposed_to_sent_p99_us);
  return kExitOk;
}

}  // namespace mocap::bench
