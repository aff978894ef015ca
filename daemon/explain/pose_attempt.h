#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/time.h"
#include "identify/rigid_finder.h"
#include "identify/tpose_finder.h"
#include "model/points.h"
#include "model/skeleton.h"

namespace mocap::explain {

/// A pose of a person is plausible if it has a point for kMinPoseShare of the markers of the set, and explains
/// kMinExplainedShare of the markers in 3D. Measured on simulated people in about T-pose with 15 to 75 % of their
/// markers removed (four sets; size 0.85 to 1.15, joints 6 degrees rms, noise 2 mm): of the markers that a plausible
/// pose reports as missing, 91 to 98 % were removed, by tenth of the share (seeds 1 to 60), and 95 to 100 % with seeds
/// 61 to 120. For poses with a share below 0.3, 40 % were removed.
inline constexpr double kMinPoseShare = 0.4;
inline constexpr double kMinExplainedShare = 0.9;

/// The thresholds of the search that is explained, as in [label] and [match].
struct ExplainSettings {
  double least_share = 0.85;
  double most_rms_m = 0.02;
  double rigid_tolerance_m = 0.006;
  std::uint32_t min_views_new = 3;
  Duration still_for = std::chrono::milliseconds(400);
};

/// The best pose of a marker set in some points, even if it has too few markers for an identification.
struct PoseAttempt {
  std::uint32_t matched = 0;         ///< markers with a point
  double rms_m = 0.0;                ///< of these points
  bool found = false;                ///< the search would accept the pose
  bool ambiguous = false;            ///< enough markers, but another pose fits about as well
  std::vector<int> point_of_marker;  ///< -1: no point; empty: no pose
  std::vector<WorldPoint> expected;  ///< by marker
};

/// Searches one marker set with fewer demands than an identification: a person in T-pose and A-pose, a rigid body with
/// one marker missing.
class PoseAttempts {
 public:
  PoseAttempts(const MarkerSet& set, const ExplainSettings& settings);

  PoseAttempt best(std::span<const Eigen::Vector3d> points);
  /// Markers that an identification of a body that is not fitted needs.
  std::uint32_t needed() const { return needed_; }

 private:
  PoseAttempt person(identify::TPoseFinder& finder, std::span<const Eigen::Vector3d> points, double share) const;
  PoseAttempt rigid(std::span<const Eigen::Vector3d> points);
  PoseAttempt rigid_without(std::size_t marker, std::span<const Eigen::Vector3d> points) const;

  MarkerSet set_;
  ExplainSettings settings_;
  std::uint32_t needed_;
  std::optional<identify::TPoseFinder> tpose_, apose_;
  std::optional<identify::RigidFinder> rigid_;
};

}  // namespace mocap::explain
