#include "explain/standing_view.h"

#include <algorithm>
#include <numbers>
#include <vector>

#include "geometry/lens.h"
#include "kinematics/pose_fit.h"

namespace mocap::explain {
namespace {

constexpr int kHeadings = 8;

double median(std::span<const WorldPoint> points, int axis) {
  std::vector<double> values;
  for (const WorldPoint& point : points) values.push_back(point.v[axis]);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Markers of a person in rest pose; the root is above the origin and the lowest marker on the floor.
std::vector<Eigen::Vector3d> standing(const MarkerSet& set) {
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.place(Pose{});
  std::vector<Eigen::Vector3d> markers;
  for (std::size_t m = 0; m < set.markers.size(); ++m) markers.push_back(body.marker_at(m));
  double lowest_m = 0.0;
  for (const Eigen::Vector3d& marker : markers) lowest_m = std::min(lowest_m, marker.z());
  for (Eigen::Vector3d& marker : markers) marker.z() -= lowest_m;
  return markers;
}

}  // namespace

bool in_view(const CameraModel& camera, const WorldPoint& point) {
  const auto pixel = geometry::project(camera, point);
  return pixel && geometry::in_image(camera, *pixel);
}

std::uint32_t cameras_with_view_of(const Rig& rig, const WorldPoint& point) {
  return static_cast<std::uint32_t>(
      std::ranges::count_if(rig, [&](const CameraModel& camera) { return in_view(camera, point); }));
}

std::uint32_t standing_markers_in_view(const Rig& rig, const MarkerSet& set, std::span<const WorldPoint> points,
                                       std::uint32_t views) {
  if (points.empty()) return static_cast<std::uint32_t>(set.markers.size());
  const std::vector<Eigen::Vector3d> markers = standing(set);
  const Eigen::Vector3d place(median(points, 0), median(points, 1), 0.0);
  std::uint32_t most = 0;
  for (int h = 0; h < kHeadings; ++h) {
    const Eigen::AngleAxisd heading(2.0 * std::numbers::pi * h / kHeadings, Eigen::Vector3d::UnitZ());
    const auto seen = std::ranges::count_if(markers, [&](const Eigen::Vector3d& marker) {
      return cameras_with_view_of(rig, {heading * marker + place}) >= views;
    });
    most = std::max(most, static_cast<std::uint32_t>(seen));
  }
  return most;
}

}  // namespace mocap::explain
