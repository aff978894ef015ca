#include "explain/pose_attempt.h"

#include <algorithm>
#include <cmath>

#include "geometry/rigid_fit.h"
#include "identify/calibration_pose.h"
#include "model/search_report.h"

namespace mocap::explain {
namespace {

// A rigid body of this many markers or more is found with one marker missing (identify/rigid_finder.h).
constexpr std::size_t kMarkersWithSpare = 5;

std::uint32_t needed_of(const MarkerSet& set, double share) {
  const std::size_t count = set.markers.size();
  if (set.skeleton.bones.size() == 1) return static_cast<std::uint32_t>(count - (count >= kMarkersWithSpare ? 1 : 0));
  return static_cast<std::uint32_t>(std::ceil(share * static_cast<double>(count) - 1e-9));
}

}  // namespace

PoseAttempts::PoseAttempts(const MarkerSet& set, const ExplainSettings& settings)
    : set_(set), settings_(settings), needed_(needed_of(set, settings.least_share)) {
  if (set.skeleton.bones.size() == 1) {
    rigid_.emplace(set, settings.rigid_tolerance_m);
    return;
  }
  identify::FindSettings find{.min_marker_fraction = std::min(kMinPoseShare, settings.least_share),
                              .max_rms_m = settings.most_rms_m};
  tpose_.emplace(set, find, kMaxReportPoints);
  find.max_joint_angle_rad = identify::kMaxAPoseDeviation_rad;
  if (const auto pose = identify::make_a_pose(set, identify::kAPoseArmAngle_rad)) {
    apose_.emplace(pose->set, find, kMaxReportPoints);
  }
}

PoseAttempt PoseAttempts::best(std::span<const Eigen::Vector3d> points) {
  if (rigid_) return rigid(points);
  PoseAttempt in_tpose = person(*tpose_, points, settings_.least_share);
  if (in_tpose.found || !apose_) return in_tpose;
  const double share = std::max(settings_.least_share, identify::kMinAPoseMarkerFraction);
  PoseAttempt in_apose = person(*apose_, points, share);
  return in_apose.found || in_apose.matched > in_tpose.matched ? in_apose : in_tpose;
}

PoseAttempt PoseAttempts::person(identify::TPoseFinder& finder, std::span<const Eigen::Vector3d> points,
                                 double share) const {
  (void)finder.find(points);
  const identify::TPoseAttempt& attempt = finder.attempt();
  PoseAttempt made;
  made.matched = static_cast<std::uint32_t>(attempt.matched);
  made.rms_m = attempt.rms_m;
  made.point_of_marker.assign(attempt.point_of_marker.begin(), attempt.point_of_marker.end());
  made.expected.assign(attempt.expected.begin(), attempt.expected.end());
  const bool enough = made.matched >= share * static_cast<double>(set_.markers.size());
  made.found = enough && attempt.outcome == identify::TPoseOutcome::Found;
  made.ambiguous = enough && attempt.outcome == identify::TPoseOutcome::Ambiguous;
  return made;
}

PoseAttempt PoseAttempts::rigid(std::span<const Eigen::Vector3d> points) {
  PoseAttempt made;
  if (const auto& found = rigid_->find(points)) {
    made.found = true;
    made.matched = static_cast<std::uint32_t>(found->matched);
    made.rms_m = found->rms_m;
    return made;
  }
  for (std::size_t m = 0; set_.markers.size() > 3 && m < set_.markers.size(); ++m) {
    PoseAttempt without = rigid_without(m, points);
    if (without.matched > 0 && (made.matched == 0 || without.rms_m < made.rms_m)) made = std::move(without);
  }
  return made;
}

PoseAttempt PoseAttempts::rigid_without(std::size_t marker, std::span<const Eigen::Vector3d> points) const {
  MarkerSet fewer = set_;
  fewer.markers.erase(fewer.markers.begin() + static_cast<std::ptrdiff_t>(marker));
  identify::RigidFinder finder(fewer, settings_.rigid_tolerance_m);
  PoseAttempt made;
  const auto& found = finder.find(points);
  if (!found || found->matched < static_cast<int>(fewer.markers.size())) return made;
  made.matched = static_cast<std::uint32_t>(found->matched);
  made.rms_m = found->rms_m;
  std::vector<geometry::PointPair> pairs;
  for (std::size_t m = 0; m < fewer.markers.size(); ++m) {
    const int p = found->point_of_marker[m];
    made.point_of_marker.push_back(p);
    pairs.push_back({fewer.markers[m].offset_m, points[static_cast<std::size_t>(p)]});
  }
  made.point_of_marker.insert(made.point_of_marker.begin() + static_cast<std::ptrdiff_t>(marker), -1);
  const auto aligned = geometry::fit_rigid(pairs);
  if (!aligned) return {};
  for (const MarkerOnBone& each : set_.markers) made.expected.push_back({aligned->to_from * each.offset_m});
  return made;
}

}  // namespace mocap::explain
