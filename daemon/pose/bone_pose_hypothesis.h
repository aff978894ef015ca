#pragma once

#include <Eigen/Core>
#include <span>

#include "model/skeleton.h"
#include "model/transform.h"
#include "pose/bone_pose_proposer.h"

namespace mocap::pose {

/// A bone as a reading of the points has it.
struct BonePoseHypothesis {
  Pose world;
  Dof dof = Dof::None;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();     ///< of what is open, as BoneProposal has it
  Eigen::Vector3d joint_m = Eigen::Vector3d::Zero();  ///< where it hangs, in its frame
  double joint_sigma_m = 0.0;                         ///< of that place
};

/// How far a turn against the parent is beyond a joint's ranges, squared, rad^2.
double squared_range_excess(const Bone& bone, const Eigen::Quaterniond& local);

/// Turns bones that were swung on one point about it to where their joints' ranges, and those of what hangs on them,
/// allow it best; unseen ones go with their parents.
void resolve_twist(const Skeleton& skeleton, std::span<BonePoseHypothesis> bones);

/// The same bones as poses in their parents' frames, as PoseFit has them.
void to_local_poses(const Skeleton& skeleton, std::span<const BonePoseHypothesis> bones, std::span<Pose> locals);

}  // namespace mocap::pose
