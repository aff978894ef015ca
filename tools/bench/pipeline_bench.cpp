#include "bench/pipeline_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "assemble.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"
#include "support/allocation_counter.h"

namespace mocap::bench {
namespace {

constexpr Duration kWarmUp = std::chrono::seconds(2);

// Forwards each call to the real publisher and records the latencies in preallocated memory.
class MeasuringPublisher : public Publisher {
 public:
  MeasuringPublisher(std::unique_ptr<Publisher> real, std::vector<Duration>& spans, PipelineBenchFigures& figures,
                     const std::atomic<bool>& measuring)
      : real_(std::move(real)), spans_(spans), figures_(figures), measuring_(measuring) {}

  Status describe(const Description& description) override { return real_->describe(description); }
  Status report(const Health& health) override { return real_->report(health); }

  Status publish(Snapshot& snapshot) override {
    Status sent = real_->publish(snapshot);
    if (!measuring_.load(std::memory_order_relaxed) || !sent || spans_.size() == spans_.capacity()) return sent;
    spans_.push_back(*snapshot.instants.sent_at - *snapshot.instants.detected_at);
    if (snapshot.views.size() == snapshot.expected_views) ++complete_;
    for (const SubjectLabels& subject : snapshot.labels) {
      for (const LabelledMarker& marker : subject.markers) placed_ += marker.state == LabelState::Lost ? 0U : 1U;
      markers_ += subject.markers.size();
    }
    figures_.complete_share = static_cast<double>(complete_) / static_cast<double>(spans_.size());
    figures_.labelled_share = markers_ == 0 ? 0.0 : static_cast<double>(placed_) / static_cast<double>(markers_);
    return sent;
  }

 private:
  std::unique_ptr<Publisher> real_;
  std::vector<Duration>& spans_;
  PipelineBenchFigures& figures_;
  const std::atomic<bool>& measuring_;
  std::uint64_t complete_ = 0;
  std::uint64_t placed_ = 0;
  std::uint64_t markers_ = 0;
};

settings::DaemonSettings synthetic_daemon(const PipelineBenchSettings& wanted, const MarkerSet& marker_set) {
  settings::DaemonSettings settings;
  settings.rig =
      scene::ring_rig({.cameras = wanted.cameras, .width_px = wanted.width_px, .height_px = wanted.height_px});
  const Timestamp epoch = host_now() + std::chrono::milliseconds(200);
  for (const CameraModel& camera : settings.rig) {
    cameras::SyntheticSettings synthetic;
    synthetic.motion = "tpose:2,walk";
    synthetic.width_px = wanted.width_px;
    synthetic.height_px = wanted.height_px;
    synthetic.rate_hz = wanted.rate_hz;
    synthetic.seed = wanted.seed;
    synthetic.epoch = epoch;
    settings.cameras.push_back({camera.name, synthetic});
    settings.simulated.push_back(marker_set);
  }
  settings.subjects.push_back({.name = "subject", .marker_set_file = wanted.marker_set, .file = {}, .keep = {}});
  settings.subject_models.push_back({"subject", marker_set});
  settings.nominal_rate_hz = wanted.rate_hz;
  // The synthetic cameras draw their images one after the other on the measured cores, so the last image may be late by
  // half a period.
  settings.pipeline.align.patience = from_s(0.5 / wanted.rate_hz);
  settings.publish.endpoint = "tcp://127.0.0.1:*";
  return settings;
}

std::uint64_t dropped_so_far(const runtime::Pipeline& pipeline) {
  const runtime::FusionCounters& fusion = pipeline.fusion_counters();
  std::uint64_t dropped = fusion.passed_over_sets.read() + fusion.dropped_publish_full.read() +
                          pipeline.publish_counters().passed_over.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    const runtime::CameraCounters& camera = pipeline.camera_counters(CameraId{i});
    dropped += camera.dropped_queue_full.read() + camera.missing_frames.read();
  }
  return dropped;
}

double microseconds_at(const std::vector<Duration>& sorted, double share) {
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1));
  return to_us(sorted[rank]);
}

}  // namespace

Result<PipelineBenchFigures> run_pipeline_bench(const PipelineBenchSettings& wanted) {
  const Result<MarkerSet> marker_set = settings::load_marker_set(wanted.marker_set);
  if (!marker_set) return marker_set.error();
  const settings::DaemonSettings daemon = synthetic_daemon(wanted, *marker_set);
  Result<Assembly> assembly = assemble(daemon);
  if (!assembly) return assembly.error();

  PipelineBenchFigures figures;
  std::vector<Duration> spans;
  spans.reserve(static_cast<std::size_t>(wanted.rate_hz * (wanted.seconds + 1.0)));
  std::atomic<bool> measuring{false};
  assembly->parts.publisher =
      std::make_unique<MeasuringPublisher>(std::move(assembly->parts.publisher), spans, figures, measuring);
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));

  WakeSignal nobody_calls;
  nobody_calls.wait(nobody_calls.ticket(), kWarmUp);
  const std::uint64_t dropped_before = dropped_so_far(pipeline);
  support::start_counting_allocations();
  measuring = true;
  nobody_calls.wait(nobody_calls.ticket(), from_s(wanted.seconds));
  measuring = false;
  const support::AllocationCount counted = support::stop_counting_allocations();
  figures.dropped = dropped_so_far(pipeline) - dropped_before;
  pipeline.stop();

  if (spans.empty()) return Error{ErrorCode::Timeout, "no snapshot came; is the machine too slow for these cameras?"};
  std::sort(spans.begin(), spans.end());
  figures.sets = spans.size();
  figures.p50_us = microseconds_at(spans, 0.50);
  figures.p99_us = microseconds_at(spans, 0.99);
  figures.max_us = to_us(spans.back());
  figures.allocations = counted.by_new + counted.by_malloc;
  return figures;
}

}  // namespace mocap::bench
