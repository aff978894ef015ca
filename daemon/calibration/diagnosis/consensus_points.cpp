#include "calibration/diagnosis/consensus_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "geometry/epipolar.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"

namespace mocap::calibration {
namespace {

// Bounds the work for many cameras: 6 partners of each camera find every marker that three of them see.
constexpr std::size_t kNeighbours = 6;
// A ray passes a blob within this distance: chi-square quantile, 1 degree of freedom, 99.7 %, for the deviation of
// 1 px rms at which a camera deviates from the rig by the default of verify.
constexpr double kGate_px = 3.0;
// A point counts this often in each cube of this size; 3 cm are 5 to 15 px in a volume of usual size.
constexpr int kMaxRepetitions = 3;
constexpr double kCube_m = 0.03;
constexpr std::size_t kConfirmedViews = 3;
// More cameras confirm each other. The accidental intersections of two rays, which grow with the number of pairs of
// cameras, would then only add noise.
constexpr std::size_t kMaxCamerasOfPairs = 4;
// With fewer confirmed points in the whole recording the cameras do not confirm each other.
constexpr std::size_t kMinConfirmed = 200;

/// The relation of two cameras.
struct CameraPair {
  std::size_t a = 0;
  std::size_t b = 0;
  Eigen::Matrix3d essential;
};

std::vector<CameraPair> pairs_of(const std::vector<CameraViews>& cameras) {
  std::vector<CameraPair> pairs;
  const std::size_t count = cameras.size();
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t step = 1; step <= std::min(kNeighbours, count - 1); ++step) {
      const std::size_t b = (a + step) % count;
      if (2 * step > count || (2 * step == count && a > b)) continue;  // the other camera has this pair
      pairs.push_back(
          {a, b, geometry::essential(cameras[a].model.camera_from_world, cameras[b].model.camera_from_world)});
    }
  }
  return pairs;
}

// Distance of two rays from intersection, in standard deviations of 1 px in each image (Sampson distance).
double sampson_px(const CameraPair& pair, const CameraViews& a, const CameraViews& b, const NormalizedPoint& ray_a,
                  const NormalizedPoint& ray_b) {
  const Eigen::Vector3d line_b = pair.essential * ray_a.v.homogeneous();
  const Eigen::Vector3d line_a = pair.essential.transpose() * ray_b.v.homogeneous();
  const double spread =
      std::hypot(line_b.head<2>().norm() / b.model.lens.fx_px, line_a.head<2>().norm() / a.model.lens.fx_px);
  return spread > 0.0 ? std::abs(line_b.dot(ray_b.v.homogeneous())) / spread : 1e9;
}

std::optional<WorldPoint> triangulated(const std::vector<CameraViews>& cameras, std::size_t instant,
                                       const std::vector<RayIntersection::View>& views) {
  std::vector<geometry::Sighting> sightings;
  for (const auto& [camera, blob] : views) {
    const CameraModel& model = cameras[camera].model;
    sightings.push_back({&model.camera_from_world, cameras[camera].instants[instant][blob].ray,
                         model.lens.fx_px * Eigen::Matrix2d::Identity(), 1.0, 0});
  }
  const auto point = geometry::triangulate(sightings);
  return point ? std::optional(*point) : std::nullopt;
}

// Adds the nearest blob of each other camera at the projection of the intersection.
void confirm(const std::vector<CameraViews>& cameras, std::size_t instant, RayIntersection& intersection) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (c == intersection.views[0].camera || c == intersection.views[1].camera) continue;
    const auto at = geometry::project(cameras[c].model, intersection.point);
    if (!at) continue;
    double nearest_px = kGate_px;
    std::optional<std::size_t> found;
    const auto& blobs = cameras[c].instants[instant];
    for (std::size_t b = 0; b < blobs.size(); ++b) {
      const double distance_px = (blobs[b].at.v - at->v).norm();
      if (distance_px >= nearest_px) continue;
      nearest_px = distance_px;
      found = b;
    }
    if (found) intersection.views.push_back({c, *found});
  }
}

std::vector<RayIntersection> intersections_at(const std::vector<CameraViews>& cameras,
                                              const std::vector<CameraPair>& pairs, std::size_t instant) {
  std::vector<RayIntersection> intersections;
  for (const CameraPair& pair : pairs) {
    const auto& in_a = cameras[pair.a].instants[instant];
    const auto& in_b = cameras[pair.b].instants[instant];
    for (std::size_t i = 0; i < in_a.size(); ++i) {
      for (std::size_t j = 0; j < in_b.size(); ++j) {
        if (sampson_px(pair, cameras[pair.a], cameras[pair.b], in_a[i].ray, in_b[j].ray) > kGate_px) continue;
        RayIntersection intersection{{}, {{pair.a, i}, {pair.b, j}}};
        const auto point = triangulated(cameras, instant, intersection.views);
        if (!point) continue;
        intersection.point = *point;
        confirm(cameras, instant, intersection);
        intersections.push_back(std::move(intersection));
      }
    }
  }
  return intersections;
}

/// Takes points with many views first, and each blob once.
class PointPicker {
 public:
  PointPicker(const std::vector<CameraViews>& cameras, std::size_t excluded, bool with_pairs)
      : cameras_(cameras), excluded_(excluded), with_pairs_(with_pairs) {}

  std::vector<ConsensusPoint> pick(const std::vector<RayIntersection>& intersections, std::size_t instant) {
    used_.clear();
    std::vector<RayIntersection> others = without_excluded(intersections);
    std::ranges::stable_sort(others, std::ranges::greater{}, [](const RayIntersection& m) { return m.views.size(); });
    std::vector<ConsensusPoint> points;
    for (const RayIntersection& intersection : others) {
      const bool is_confirmed = intersection.views.size() >= kConfirmedViews;
      const bool is_free = std::ranges::none_of(intersection.views, [&](const RayIntersection::View& view) {
        return used_.contains({view.camera, view.blob});
      });
      if (!is_free || !(is_confirmed || with_pairs_)) continue;
      const auto point = triangulated(cameras_, instant, intersection.views);
      if (!point) continue;
      if (is_confirmed) {
        for (const auto& [camera, blob] : intersection.views) used_.insert({camera, blob});
      }
      if (counts(*point)) points.push_back({*point, is_confirmed});
    }
    return points;
  }

 private:
  std::vector<RayIntersection> without_excluded(const std::vector<RayIntersection>& intersections) const {
    std::vector<RayIntersection> others;
    for (const RayIntersection& intersection : intersections) {
      if (intersection.views[0].camera == excluded_ || intersection.views[1].camera == excluded_) continue;
      RayIntersection& other = others.emplace_back(intersection);
      std::erase_if(other.views, [&](const RayIntersection::View& view) { return view.camera == excluded_; });
    }
    return others;
  }

  bool counts(const WorldPoint& point) {
    const Eigen::Vector3d cube = point.v / kCube_m;
    if (cube.cwiseAbs().maxCoeff() > 1e6) return false;  // 30 km away: rays that are nearly parallel
    return ++repetitions_[{std::lround(cube.x()), std::lround(cube.y()), std::lround(cube.z())}] <= kMaxRepetitions;
  }

  const std::vector<CameraViews>& cameras_;
  std::size_t excluded_;
  bool with_pairs_;
  std::set<std::pair<std::size_t, std::size_t>> used_;
  std::map<std::array<long, 3>, int> repetitions_;
};

std::vector<std::vector<ConsensusPoint>> pick_all(const RayIntersections& intersections, PointPicker picker) {
  std::vector<std::vector<ConsensusPoint>> points;
  for (std::size_t i = 0; i < intersections.size(); ++i) points.push_back(picker.pick(intersections[i], i));
  return points;
}

std::size_t count_confirmed(const std::vector<std::vector<ConsensusPoint>>& points) {
  std::size_t count = 0;
  for (const auto& instant : points)
    count += static_cast<std::size_t>(std::ranges::count_if(instant, &ConsensusPoint::is_confirmed));
  return count;
}

}  // namespace

RayIntersections find_intersections(const std::vector<CameraViews>& cameras) {
  RayIntersections all;
  const auto pairs = pairs_of(cameras);
  const std::size_t instants = cameras.empty() ? 0 : cameras.front().instants.size();
  for (std::size_t i = 0; i < instants; ++i) all.push_back(intersections_at(cameras, pairs, i));
  return all;
}

std::vector<std::vector<ConsensusPoint>> consensus_points(const RayIntersections& intersections,
                                                          const std::vector<CameraViews>& cameras, std::size_t excluded,
                                                          Fallback fallback) {
  const bool few_cameras = cameras.size() <= kMaxCamerasOfPairs + 1;
  auto points = pick_all(intersections, {cameras, excluded, few_cameras});
  if (few_cameras || fallback == Fallback::None || count_confirmed(points) >= kMinConfirmed) return points;
  return pick_all(intersections, {cameras, excluded, true});
}

}  // namespace mocap::calibration
