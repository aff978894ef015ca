#include "bench/fuse/fuse_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "bench/at_share.h"
#include "bench/fuse/fuse_reference.h"
#include "lib/thread_time.h"
#include "model/identity_map.h"
#include "settings/subject/marker_set_file.h"
#include "synchronise/frame_aligner.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::bench {
namespace {

constexpr double kNear_m = 0.01;     // an output farther than this from every true marker is a ghost
constexpr int kReferenceSets = 100;  // few sets suffice: the reference is slow with many cameras and varies little

enum Part { kAlign, kPredict, kMatch, kTriangulate, kTrack, kPartCount };

struct Spans {
  std::vector<double> whole_us, cpu_us, reference_us;
  std::array<std::vector<double>, kPartCount> part_us;
};

// Comparison of the markers of all sets with the truth.
struct Truth {
  std::uint64_t visible = 0;
  std::uint64_t found = 0;
  std::uint64_t ghosts = 0;
  std::uint64_t near = 0;
  double sum_of_squares_m2 = 0.0;

  void judge(const simworld::FuseWorld& world, const Markers& markers, int enough_views) {
    std::vector<bool> has(world.markers().size(), false);
    for (const Marker& marker : markers) {
      std::size_t nearest = 0;
      double least_m2 = kNear_m * kNear_m;
      bool real = false;
      for (std::size_t m = 0; m < has.size(); ++m) {
        const double off_m2 = (world.markers()[m].v - marker.position.v).squaredNorm();
        if (off_m2 >= least_m2) continue;
        least_m2 = off_m2;
        nearest = m;
        real = true;
      }
      ghosts += real ? 0U : 1U;
      if (!real) continue;
      has[nearest] = true;
      ++near;
      sum_of_squares_m2 += least_m2;
    }
    for (std::size_t m = 0; m < has.size(); ++m) {
      if (world.views()[m] < enough_views) continue;
      ++visible;
      found += has[m] ? 1U : 0U;
    }
  }
};

// The pipeline from blobs to 3D tracks.
class Row {
 public:
  Row(const Rig& rig, bool predicted)
      : predicted_(predicted),
        aligner_({}, rig.size()),
        matcher_(associate::make_matcher({}, rig)),
        triangulator_(associate::make_triangulator({}, rig)),
        tracker_(track3d::make_marker_tracker({})),
        identities_(rig.size()) {}

  // `at` receives the start of each part and the end of the last part.
  const Markers& step(const simworld::FuseWorld& world, std::array<Timestamp, kPartCount + 1>& at) {
    at[kAlign] = host_now();
    for (const auto& frame : world.frames()) aligner_.add(*frame);
    const std::optional<FrameSet> set = aligner_.take(Timestamp::min());
    MOCAP_EXPECTS(set.has_value());
    at[kPredict] = host_now();
    const Predictions& predicted =
        identities_.predict(*set, predicted_ ? tracker_->predict(set->exposed_at) : no_predictions_, no_predictions_);
    at[kMatch] = host_now();
    const Matches& matches = matcher_->match(*set, predicted);
    at[kTriangulate] = host_now();
    const Markers& markers = triangulator_->triangulate(*set, matches);
    at[kTrack] = host_now();
    tracker_->step(markers, predicted);
    identities_.update(*set, matches, {});
    at[kPartCount] = host_now();
    skipped_ = matches.skipped;
    return markers;
  }

  std::uint32_t skipped() const { return skipped_; }

 private:
  bool predicted_;
  synchronise::FrameAligner aligner_;
  std::unique_ptr<Matcher> matcher_;
  std::unique_ptr<Triangulator> triangulator_;
  std::unique_ptr<MarkerTracker> tracker_;
  IdentityMap identities_;
  PredictedMarkers no_predictions_;
  std::uint32_t skipped_ = 0;
};

void keep(Spans& spans, const std::array<Timestamp, kPartCount + 1>& at, Duration cpu) {
  spans.whole_us.push_back(to_us(at[kPartCount] - at[0]));
  spans.cpu_us.push_back(to_us(cpu));
  for (std::size_t part = 0; part < kPartCount; ++part) spans.part_us[part].push_back(to_us(at[part + 1] - at[part]));
}

FuseBenchFigures figures_of(const Spans& spans, const Truth& truth, const FuseBenchSettings& settings) {
  FuseBenchFigures f;
  f.cameras = settings.world.cameras;
  f.markers = settings.world.markers;
  f.median_us = at_share(spans.whole_us, 0.5);
  f.p99_us = at_share(spans.whole_us, 0.99);
  f.max_us = at_share(spans.whole_us, 1.0);
  f.median_cpu_us = at_share(spans.cpu_us, 0.5);
  f.p99_cpu_us = at_share(spans.cpu_us, 0.99);
  f.align_us = at_share(spans.part_us[kAlign], 0.5);
  f.match_us = at_share(spans.part_us[kMatch], 0.5);
  f.triangulate_us = at_share(spans.part_us[kTriangulate], 0.5);
  f.track_us = at_share(spans.part_us[kPredict], 0.5) + at_share(spans.part_us[kTrack], 0.5);
  f.opencv_us = at_share(spans.reference_us, 0.5);
  f.speedup_opencv = f.opencv_us / f.median_us;
  f.recall = truth.visible == 0 ? 0.0 : static_cast<double>(truth.found) / static_cast<double>(truth.visible);
  f.ghosts_per_1000 = 1000.0 * static_cast<double>(truth.ghosts) / settings.sets;
  f.rms_mm = truth.near == 0 ? 0.0 : 1000.0 * std::sqrt(truth.sum_of_squares_m2 / static_cast<double>(truth.near));
  return f;
}

FuseBenchFigures measure(const FuseBenchSettings& settings, const MarkerSet& marker_set, bool predicted) {
  simworld::FuseWorld world(settings.world, marker_set);
  FuseReference reference(world.rig());
  Row row(world.rig(), predicted);
  Spans spans;
  Truth truth;
  double blobs = 0.0;
  double skipped = 0.0;
  std::array<Timestamp, kPartCount + 1> at;
  const auto warm_up = static_cast<int>(settings.world.rate_hz);
  for (int number = 0; number < warm_up + settings.sets; ++number) {
    world.step(static_cast<std::uint64_t>(number));
    const Duration before = thread_time();
    const Markers& markers = row.step(world, at);
    const Duration after = thread_time();
    if (number < warm_up) continue;
    keep(spans, at, after - before);
    truth.judge(world, markers, predicted ? 2 : 3);
    skipped += row.skipped();
    for (const auto& frame : world.frames()) blobs += static_cast<double>(frame->blobs.size());
    if (number - warm_up >= kReferenceSets) continue;
    const Timestamp begun = host_now();
    static_cast<void>(reference.step(world.frames()));
    spans.reference_us.push_back(to_us(host_now() - begun));
  }
  FuseBenchFigures figures = figures_of(spans, truth, settings);
  figures.mode = predicted ? "predicted" : "cold";
  figures.blobs = blobs / settings.sets;
  figures.ns_per_blob = 1000.0 * figures.median_us / figures.blobs;
  figures.skipped = skipped / settings.sets;
  return figures;
}

}  // namespace

Result<std::vector<FuseBenchFigures>> run_fuse_bench(const FuseBenchSettings& settings) {
  const Result<MarkerSet> marker_set = settings::load_marker_set(settings.marker_set);
  if (!marker_set) return marker_set.error();
  return std::vector{measure(settings, *marker_set, true), measure(settings, *marker_set, false)};
}

}  // namespace mocap::bench
