#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "model/skeleton.h"
#include "model/subject_state.h"
#include "model/transform.h"

namespace mocap::benchmark {

/// Mean errors of one bone.
struct BoneFigures {
  std::string bone;
  double joint_cm = 0.0;
  double rotation_deg = 0.0;
};

/// Errors of the joints and bones, over all frames after the beginning of the clip in which the daemon has a pose. NaN
/// if it has none.
struct SkeletonFigures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t frames = 0;        ///< scored frames
  double posed_share = 0.0;        ///< of these, with a pose
  double joint_cm = kNone;         ///< mean distance of a joint from its true position
  double joint_p99_cm = kNone;     ///< 99th percentile of these distances
  double rotation_deg = kNone;     ///< mean angle between a bone's rotation in the world and the true one
  std::vector<BoneFigures> bones;  ///< in the order of the skeleton; empty without a pose
  double ms_per_frame = 0.0;       ///< CPU time of the daemon's steps in this thread, mean
};

/// Collects the errors of poses.
class SkeletonErrors {
 public:
  explicit SkeletonErrors(const Skeleton& skeleton);

  /// `truth`: world_from_bone, one for each bone of the pose. Lost bones are left out.
  void add(const SubjectPose& pose, const Pose* truth);
  /// `frames`: scored, with or without a pose. The CPU time stays 0.
  SkeletonFigures figures(std::uint64_t frames);

 private:
  std::vector<double> joints_cm_;
  std::vector<BoneFigures> bones_;  // sums
  std::vector<double> counts_;
  std::uint64_t posed_ = 0;
};

}  // namespace mocap::benchmark
