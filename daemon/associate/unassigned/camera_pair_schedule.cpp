#include "associate/unassigned/camera_pair_schedule.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/epipolar.h"

namespace mocap::associate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The point nearest to the optical axes of all cameras in the least-squares sense; regularised for parallel axes.
Vector3d centre_of_view(const Rig& rig) {
  Matrix3d normal = 1e-6 * Matrix3d::Identity();
  Vector3d rhs = Vector3d::Zero();
  for (const CameraModel& camera : rig) {
    const Vector3d axis = camera.camera_from_world.rotation.row(2).transpose();
    const Matrix3d across = Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    rhs += across * camera.centre().v;
  }
  return normal.inverse() * rhs;
}

}  // namespace

// Cameras 60 degrees apart are near enough to see the same side of a body and far enough apart to measure depth. Chosen
// by hand; not yet measured.
CameraPairSchedule::CameraPairSchedule(const Rig& rig) {
  constexpr double kBestAngle_rad = std::numbers::pi / 3.0;
  struct Candidate {
    double angle_error;
    std::uint32_t a, b;
  };
  const Vector3d centre = centre_of_view(rig);
  std::vector<Candidate> candidates;
  for (std::uint32_t a = 0; a < rig.size(); ++a) {
    for (std::uint32_t b = a + 1; b < rig.size(); ++b) {
      const Vector3d to_a = (rig[a].centre().v - centre).normalized();
      const Vector3d to_b = (rig[b].centre().v - centre).normalized();
      const double angle = std::acos(std::clamp(to_a.dot(to_b), -1.0, 1.0));
      candidates.push_back({std::abs(angle - kBestAngle_rad), a, b});
    }
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::angle_error);
  std::vector<std::uint64_t> used_cameras;  // by round: cameras with a partner, one bit each
  for (const auto& [angle_error, a, b] : candidates) {
    const std::uint64_t both = (std::uint64_t{1} << a) | (std::uint64_t{1} << b);
    std::size_t round = 0;
    while (round < used_cameras.size() && (used_cameras[round] & both) != 0) ++round;
    if (round == used_cameras.size()) used_cameras.push_back(0);
    used_cameras[round] |= both;
    pairs_.push_back({a, b, round, geometry::essential(rig[a].camera_from_world, rig[b].camera_from_world)});
  }
  std::ranges::stable_sort(pairs_, {}, &CameraPair::round);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (pairs_[i].round == first_of_round_.size()) first_of_round_.push_back(i);
  }
  first_of_round_.push_back(pairs_.size());
}

}  // namespace mocap::associate
