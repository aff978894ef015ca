#include "calibration/wand/initial_extrinsics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Smallest fraction of inliers among the samples that two cameras share: fewer may agree by chance. Chosen by hand; not
// yet measured.
constexpr double kMinInlierFraction = 0.3;
// Inlier fraction that proves that a camera's images are mirrored. Chosen by hand; not yet measured.
constexpr double kMirroredInlierFraction = 0.7;

struct CameraPair {
  std::size_t a;
  std::size_t b;
  TwoViewGeometry geometry;
  double weight;  // inliers, times the sine of the median angle between the rays
};

std::vector<WandCorrespondence> correspondences_of(const WandDetections& detections, std::size_t a, std::size_t b) {
  std::vector<WandCorrespondence> pairs;
  for (std::size_t i = 0; i < detections.instants.size(); ++i) {
    if (detections.views[a][i] && detections.views[b][i])
      pairs.push_back({detections.views[a][i]->rays, detections.views[b][i]->rays});
  }
  return pairs;
}

// As correspondences_of, with the images of camera b reflected left to right.
std::vector<WandCorrespondence> mirrored_correspondences_of(const WandDetections& detections, const Rig& rig,
                                                            std::size_t a, std::size_t b, std::size_t markers) {
  std::vector<WandCorrespondence> pairs;
  for (std::size_t i = 0; i < detections.instants.size(); ++i) {
    if (!detections.views[a][i] || !detections.views[b][i]) continue;
    WandCorrespondence pair{detections.views[a][i]->rays, detections.views[b][i]->rays};
    bool complete = true;
    for (std::size_t m = 0; m < markers && complete; ++m) {
      const auto blob = static_cast<std::size_t>(detections.views[b][i]->blobs[m]);
      PixelPoint at = detections.image(b, i)->spots[blob].at;
      at.v.x() = rig[b].width_px - 1 - at.v.x();
      const auto ray = geometry::undistort(rig[b].lens, at);
      complete = ray.has_value();
      if (complete) pair.b.ray[m] = ray->v;
    }
    if (complete) pairs.push_back(pair);
  }
  return pairs;
}

WandError too_few_samples(const Rig& rig, const std::vector<std::size_t>& shared, const WandSettings& settings) {
  const auto worst = std::ranges::min_element(shared);
  const auto camera = static_cast<std::size_t>(worst - shared.begin());
  return {WandFault::TooFewSamples,
          fmt::format("camera '{}': shares {} samples with another camera, expected at least {}; wave the wand for {} "
                      "more samples in the common view of this and another camera",
                      rig[camera].name, *worst, settings.min_samples,
                      static_cast<std::size_t>(settings.min_samples) - *worst)};
}

struct CameraPairs {
  std::vector<CameraPair> pairs;    // those with enough inliers
  std::vector<std::size_t> shared;  // by camera: the largest number of samples that it shares with another camera
};

Result<CameraPairs, WandError> estimate_pairs(const WandDetections& detections, const Rig& start, const Wand& wand,
                                              const WandSettings& settings, double gate_px, const Progress& progress) {
  const std::size_t n = start.size();
  CameraPairs all{{}, std::vector<std::size_t>(n, 0)};
  std::size_t done = 0;
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      if (progress && !progress("relative poses", static_cast<double>(done++) / static_cast<double>(n * (n - 1) / 2)))
        return WandError{WandFault::NoSolution, kCancelled};
      const std::vector<WandCorrespondence> samples = correspondences_of(detections, a, b);
      all.shared[a] = std::max(all.shared[a], samples.size());
      all.shared[b] = std::max(all.shared[b], samples.size());
      if (samples.size() < static_cast<std::size_t>(settings.min_samples)) continue;
      const double f = std::min(start[a].lens.fx_px, start[b].lens.fx_px);
      const auto geometry = estimate_two_view_geometry(samples, wand, gate_px / f);
      if (!geometry || geometry->inlier_fraction < kMinInlierFraction) continue;
      const double inliers = geometry->inlier_fraction * static_cast<double>(samples.size());
      all.pairs.push_back({a, b, *geometry, inliers * std::sin(geometry->median_angle_rad)});
    }
  }
  return all;
}

// Sets the poses of all cameras that are connected with the first; returns which are.
std::vector<bool> join_pairs(const std::vector<CameraPair>& pairs, Rig& rig) {
  rig[0].camera_from_world = {};
  std::vector<bool> connected(rig.size(), false);
  connected[0] = true;
  for (std::size_t count = 1; count < rig.size(); ++count) {
    const CameraPair* best = nullptr;
    for (const CameraPair& pair : pairs) {
      if (connected[pair.a] != connected[pair.b] && (best == nullptr || pair.weight > best->weight)) best = &pair;
    }
    if (best == nullptr) break;
    if (connected[best->a]) {
      rig[best->b].camera_from_world = best->geometry.b_from_a * rig[best->a].camera_from_world;
    } else {
      rig[best->a].camera_from_world = best->geometry.b_from_a.inverse() * rig[best->b].camera_from_world;
    }
    connected[best->a] = connected[best->b] = true;
  }
  return connected;
}

}  // namespace

std::optional<WandError> check_mirrored(const WandDetections& detections, const Rig& start, std::size_t camera,
                                        const Wand& wand, const WandSettings& settings, double gate_px) {
  for (std::size_t other = 0; other < start.size(); ++other) {
    if (other == camera) continue;
    const std::vector<WandCorrespondence> pairs =
        mirrored_correspondences_of(detections, start, other, camera, wand.marks_m.size());
    if (pairs.size() < static_cast<std::size_t>(settings.min_samples)) continue;
    const auto geometry =
        estimate_two_view_geometry(pairs, wand, gate_px / std::min(start[camera].lens.fx_px, start[other].lens.fx_px));
    if (!geometry || geometry->inlier_fraction < kMirroredInlierFraction) continue;
    return WandError{
        WandFault::Mirrored,
        fmt::format("camera '{}': its images are mirrored: {:.0f} % of the samples that it shares with '{}' agree only "
                    "after a left-right reflection; switch off its ReverseX or ReverseY, or remove the mirror",
                    start[camera].name, 100.0 * geometry->inlier_fraction, start[other].name)};
  }
  return std::nullopt;
}

Result<Rig, WandError> initial_extrinsics(const WandDetections& detections, const Rig& start, const Wand& wand,
                                          const WandSettings& settings, double gate_px, const Progress& progress) {
  const std::size_t n = start.size();
  const auto estimated = estimate_pairs(detections, start, wand, settings, gate_px, progress);
  if (!estimated) return estimated.error();
  const std::vector<std::size_t>& shared = estimated->shared;
  const auto min_samples = static_cast<std::size_t>(settings.min_samples);
  if (std::ranges::all_of(shared, [](std::size_t samples) { return samples > 0; }) &&
      std::ranges::any_of(shared, [&](std::size_t samples) { return samples < min_samples; }))
    return too_few_samples(start, shared, settings);

  Rig rig = start;
  const std::vector<bool> connected = join_pairs(estimated->pairs, rig);
  for (std::size_t c = 0; c < n; ++c) {
    if (connected[c]) continue;
    if (auto error = check_mirrored(detections, start, c, wand, settings, gate_px)) return *error;
  }
  std::string missing;
  for (std::size_t c = 0; c < n; ++c) {
    if (!connected[c])
      missing += fmt::format("{}'{}' (shares {} samples)", missing.empty() ? "" : ", ", start[c].name, shared[c]);
  }
  if (!missing.empty()) {
    return WandError{
        WandFault::NoOverlap,
        fmt::format("no overlap that is consistent with the other cameras: {}; wave the wand in the common view of "
                    "each of these and another camera, and check that all cameras are synchronised",
                    missing)};
  }
  return rig;
}

}  // namespace mocap::calibration
