#include "calibration/wand/wand_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calibration/robust_statistics.h"
#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Largest relative error of the triangulated length: the first rigs are still off by some percent. Chosen by hand; not
// yet measured.
constexpr double kLengthTolerance = 0.25;
// A blob is ambiguous if another one is nearer to the projection than both of these multiples, of the gate and of the
// distance of the nearest blob. Chosen by hand; not yet measured.
constexpr double kAmbiguityGates = 2.0;
constexpr double kAmbiguityRatio = 3.0;
// Below two cameras and four observations a wand pose is not determined.
constexpr std::size_t kMinObservations = 4;

/// Triangulates the wand instant by instant and adds its pose and its observations to a bundle.
class WandTriangulator {
 public:
  WandTriangulator(const WandDetections& detections, Bundle& bundle, const WandPoseSettings& settings)
      : detections_(detections), bundle_(bundle), settings_(settings), markers_(bundle.wand.marks_m.size()) {}

  void add(std::size_t instant) {
    collect_rays(instant);
    if (cameras_.size() < 2) return;
    if (bundle_.wand.is_symmetric()) order_ends();
    WandPose pose;
    if (!triangulate(pose)) return;
    const std::size_t before = bundle_.observations.size();
    bundle_.wand_poses.push_back(pose);
    for (std::size_t c = 0; c < bundle_.rig.size(); ++c) {
      if (const Picture* image = detections_.image(c, instant)) assign_blobs(c, instant, *image);
    }
    if (!is_determined(before)) {
      bundle_.observations.resize(before);
      bundle_.wand_poses.pop_back();
    }
  }

 private:
  void collect_rays(std::size_t instant) {
    cameras_.clear();
    rays_.clear();
    for (std::size_t c = 0; c < bundle_.rig.size(); ++c) {
      const auto& view = detections_.views[c][instant];
      if (!view || static_cast<int>(c) == settings_.excluded_camera) continue;
      WandRays rays;
      bool complete = true;
      for (std::size_t m = 0; m < markers_ && complete; ++m) {
        const auto& blob = detections_.image(c, instant)->spots[static_cast<std::size_t>(view->blobs[m])];
        const auto ray = geometry::undistort(bundle_.rig[c].lens, blob.at);
        complete = ray.has_value();
        if (complete) rays.ray[m] = ray->v;
      }
      if (!complete) continue;
      cameras_.push_back(c);
      rays_.push_back(rays);
    }
  }

  // Gives the ends of a symmetric wand the same order in all cameras: that of the first camera.
  void order_ends() {
    const auto world_from_first = bundle_.rig[cameras_[0]].camera_from_world.inverse();
    for (std::size_t i = 1; i < cameras_.size(); ++i) {
      const CameraFromCamera camera_from_first = bundle_.rig[cameras_[i]].camera_from_world * world_from_first;
      WandRays reversed = rays_[i];
      std::reverse(reversed.ray.begin(), reversed.ray.begin() + static_cast<std::ptrdiff_t>(markers_));
      if (reprojection_error(camera_from_first, rays_[0], reversed) <
          reprojection_error(camera_from_first, rays_[0], rays_[i]))
        rays_[i] = reversed;
    }
  }

  // Sum over the markers, on the plane z = 1 of camera b.
  double reprojection_error(const CameraFromCamera& b_from_a, const WandRays& a, const WandRays& b) const {
    double error = 0.0;
    for (std::size_t m = 0; m < markers_; ++m) {
      const auto point = triangulate_midpoint(b_from_a, a.ray[m], b.ray[m]);
      if (!point) return 1e9;
      const Vector3d in_b = b_from_a.rotation * *point + b_from_a.translation;
      if (in_b.z() <= 0.0) return 1e9;
      error += (in_b.hnormalized() - b.ray[m]).norm();
    }
    return error;
  }

  bool triangulate(WandPose& pose) {
    std::array<Vector3d, kMaxWandMarkers> at;
    for (std::size_t m = 0; m < markers_; ++m) {
      sightings_.clear();
      for (std::size_t i = 0; i < cameras_.size(); ++i)
        sightings_.push_back(sighting_of(bundle_.rig[cameras_[i]], {rays_[i].ray[m]}, 0.1));
      const auto agreed = geometry::agree(sightings_, {.floor_px = settings_.gate_px, .sigmas = 4.0});
      if (!agreed) return false;
      at[m] = agreed->refined.point.v;
    }
    const Vector3d along = at[markers_ - 1] - at[0];
    const double length = along.norm();
    if (std::abs(length / bundle_.wand.length_m() - 1.0) > kLengthTolerance) return false;
    pose.direction = along / length;
    pose.middle_m = 0.5 * (at[0] + at[markers_ - 1]);
    return true;
  }

  // Observes each marker by its nearest blob, unless the blob is ambiguous or nearest to two markers.
  void assign_blobs(std::size_t camera, std::size_t instant, const Picture& image) {
    std::array<int, kMaxWandMarkers> assigned{-1, -1, -1};
    for (std::size_t m = 0; m < markers_; ++m) {
      const auto at = geometry::project(bundle_.rig[camera],
                                        bundle_.marker_position(bundle_.wand_poses.back(), static_cast<int>(m)));
      if (!at) continue;
      assigned[m] = nearest_blob(image, at->v);
    }
    for (std::size_t m = 0; m < markers_; ++m) {
      if (assigned[m] < 0) continue;
      if (std::ranges::count(assigned, assigned[m]) > 1) continue;
      const Spot& blob = image.spots[static_cast<std::size_t>(assigned[m])];
      bundle_.observations.push_back({static_cast<int>(camera), static_cast<int>(bundle_.wand_poses.size()) - 1,
                                      static_cast<int>(m), blob.at.v, blob.sigma_px, static_cast<int>(instant),
                                      assigned[m]});
    }
  }

  // -1: none inside the gate, or ambiguous.
  int nearest_blob(const Picture& image, const Vector2d& at) const {
    int best = -1;
    double least = settings_.gate_px;
    double second = 1e9;
    for (std::size_t b = 0; b < image.spots.size(); ++b) {
      const double distance = (image.spots[b].at.v - at).norm();
      if (distance < least) {
        second = best < 0 ? second : least;
        least = distance;
        best = static_cast<int>(b);
      } else {
        second = std::min(second, distance);
      }
    }
    return second < kAmbiguityGates * settings_.gate_px && second < kAmbiguityRatio * least ? -1 : best;
  }

  // Whether the observations from index `from` on are of two cameras and more, and enough.
  bool is_determined(std::size_t from) const {
    std::array<bool, 256> seen{};
    std::size_t cameras = 0;
    for (std::size_t i = from; i < bundle_.observations.size(); ++i) {
      auto& counted = seen[static_cast<std::size_t>(bundle_.observations[i].camera) % seen.size()];
      cameras += counted ? 0 : 1;
      counted = true;
    }
    return cameras >= 2 && bundle_.observations.size() - from >= kMinObservations;
  }

  const WandDetections& detections_;
  Bundle& bundle_;
  WandPoseSettings settings_;
  std::size_t markers_;
  std::vector<std::size_t> cameras_;  // those that detected the wand at this instant
  std::vector<WandRays> rays_;        // theirs
  std::vector<geometry::Sighting> sightings_;
};

double robust_sigma_px(const Bundle& bundle) {
  std::vector<double> lengths;
  for (const Observation& observation : bundle.observations) {
    if (const auto residual = bundle.residual_px(observation)) lengths.push_back(residual->norm());
  }
  return lengths.empty() ? 0.0 : median(std::move(lengths)) / kRayleighMedian;
}

}  // namespace

std::vector<std::size_t> sample_instants(const WandDetections& detections, const WandPoseSettings& settings) {
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < detections.instants.size(); ++i) {
    int cameras = 0;
    for (std::size_t c = 0; c < detections.views.size(); ++c)
      cameras += detections.views[c][i] && static_cast<int>(c) != settings.excluded_camera ? 1 : 0;
    if (cameras >= 2) usable.push_back(i);
  }
  if (usable.size() <= settings.max_samples) return usable;
  const std::size_t burst = std::max<std::size_t>(1, std::min(settings.burst, settings.max_samples));
  const std::size_t bursts = settings.max_samples / burst;
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < bursts * burst; ++i)
    samples.push_back(usable[i / burst * usable.size() / bursts + i % burst]);
  return samples;
}

void triangulate_wand_poses(const WandDetections& detections, Bundle& bundle, const WandPoseSettings& settings) {
  bundle.wand_poses.clear();
  bundle.observations.clear();
  WandTriangulator triangulator(detections, bundle, settings);
  for (const std::size_t instant : sample_instants(detections, settings)) triangulator.add(instant);
}

std::size_t remove_outliers(Bundle& bundle) {
  const double max_px = kOutlierSigmas * robust_sigma_px(bundle);
  const std::size_t before = bundle.observations.size();
  std::erase_if(bundle.observations, [&](const Observation& observation) {
    const auto residual = bundle.residual_px(observation);
    return !residual || residual->norm() > max_px;
  });
  return before - bundle.observations.size();
}

}  // namespace mocap::calibration
