#include "paper_study/cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <utility>

#include "base/expects.h"
#include "base/time.h"
#include "paper_study/clip.h"
#include "paper_study/cv_reference.h"
#include "paper_study/methods.h"
#include "track2d/blob_track_inspection.h"

namespace mocap::paper_study {
namespace {

constexpr int kMarkersOfAnImage = 30;  // up to this number in 640x480 px; larger images for more markers
constexpr int kWarmUpFrames = 20;      // not timed: tracks are initiated, caches are warmed
constexpr double kRadius_px = 12.0;    // radius of the circles: 2.5 px per frame
constexpr double kFramesRound = 30.0;
constexpr const char* kReference = "cv_kalman";

using Step = std::function<void(Timestamp at, std::span<Blob> blobs)>;

struct Stage {
  int width_px, height_px;
  std::vector<std::vector<Blob>> frames;  // blobs in the order of a detector: from top to bottom
};

/// Generates markers on circles in the centres of equal cells.
Stage make_stage(int markers, int frames) {
  const double more = std::sqrt(std::max(1.0, static_cast<double>(markers) / kMarkersOfAnImage));
  Stage stage{static_cast<int>(kWidth_px * more), static_cast<int>(kHeight_px * more), {}};
  const int across = static_cast<int>(std::ceil(std::sqrt(markers * 4.0 / 3.0)));
  const int down = (markers + across - 1) / across;
  for (int k = 0; k < frames; ++k) {
    std::vector<Blob> blobs;
    for (int i = 0; i < markers; ++i) {
      const int column = i % across, row = i / across;
      const double angle = 2.0 * std::numbers::pi * (k / kFramesRound + 0.618 * i);
      Blob blob;
      blob.centroid.v = {(column + 0.5) * stage.width_px / across + kRadius_px * std::cos(angle),
                         (row + 0.5) * stage.height_px / down + kRadius_px * std::sin(angle)};
      blob.sigma_px = 0.02;
      blob.area_px2 = 154.0;
      blob.peak = 1.0;
      blobs.push_back(blob);
    }
    std::ranges::sort(blobs, {}, [](const Blob& blob) { return blob.centroid.v.y(); });
    stage.frames.push_back(std::move(blobs));
  }
  return stage;
}

/// The track ids in the order of the cells, row by row. Each circle stays inside its cell.
std::vector<std::uint32_t> names_of(const Stage& stage, std::vector<Blob> blobs) {
  const int across = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(blobs.size()) * 4.0 / 3.0)));
  const int down = (static_cast<int>(blobs.size()) + across - 1) / across;
  const auto cell = [&](const Blob& blob) {
    const int x = static_cast<int>(blob.centroid.v.x() * across / stage.width_px);
    return static_cast<int>(blob.centroid.v.y() * down / stage.height_px) * across + x;
  };
  std::ranges::sort(blobs, {}, cell);
  std::vector<std::uint32_t> names;
  for (const Blob& blob : blobs) names.push_back(blob.track.value);
  return names;
}

CostRow measure(const Step& step, Stage stage) {
  std::vector<double> times_ms;
  std::vector<std::uint32_t> first;
  for (std::size_t k = 0; k < stage.frames.size(); ++k) {
    const Timestamp at = from_ns(0) + from_s(static_cast<double>(k) / kFrameRate_Hz);
    const auto begin = std::chrono::steady_clock::now();
    step(at, stage.frames[k]);
    const auto end = std::chrono::steady_clock::now();
    if (k < kWarmUpFrames) continue;
    times_ms.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
    if (first.empty()) first = names_of(stage, stage.frames[k]);
  }
  const bool kept_all =
      names_of(stage, stage.frames.back()) == first && std::ranges::find(first, BlobTrackId::kNothing) == first.end();
  return {static_cast<int>(stage.frames[0].size()), cost_of(std::move(times_ms)), kept_all};
}

CostRow measure(const Method& method, Stage stage) {
  const auto tracker =
      method.make({.width_px = stage.width_px, .height_px = stage.height_px, .max_blobs = stage.frames[0].size()});
  auto* inspection = dynamic_cast<track2d::BlobTrackInspection*>(tracker.get());
  MOCAP_EXPECTS(inspection != nullptr);
  return measure([inspection](Timestamp at, std::span<Blob> blobs) { inspection->track_all(at, blobs); },
                 std::move(stage));
}

CostRow measure_reference(Stage stage) {
  CvReference reference(0.05 * std::hypot(kWidth_px, kHeight_px));
  return measure([&reference](Timestamp, std::span<Blob> blobs) { reference.track(blobs); }, std::move(stage));
}

}  // namespace

CostFigures cost_of(std::vector<double> times_ms) {
  if (times_ms.empty()) return {};
  std::ranges::sort(times_ms);
  const auto at = [&](double share) {
    return times_ms[static_cast<std::size_t>(std::lround(share * static_cast<double>(times_ms.size() - 1)))];
  };
  return {at(0.05), at(0.5), at(0.95), times_ms.back()};
}

int cost_rows(const CostSettings& settings) {
  return static_cast<int>(settings.markers.size()) * static_cast<int>(methods().size() + 1);
}

std::vector<MethodCost> measure_costs(const CostSettings& settings, const std::function<void(int done)>& progress) {
  std::vector<MethodCost> costs;
  for (const Method& method : methods()) costs.push_back({method.name, {}});
  costs.push_back({kReference, {}});
  int done = 0;
  for (const int markers : settings.markers) {
    const Stage stage = make_stage(markers, settings.frames + kWarmUpFrames);
    for (std::size_t m = 0; m < costs.size(); ++m) {
      const bool reference = m == methods().size();
      costs[m].rows.push_back(reference ? measure_reference(stage) : measure(methods()[m], stage));
      progress(++done);
    }
  }
  return costs;
}

}  // namespace mocap::paper_study
