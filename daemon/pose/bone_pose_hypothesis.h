#pragma once

#include <Eigen/Core>
#include <span>

#include "base/archive.h"
#include "model/skeleton.h"
#include "model/transform.h"
#include "pose/bone_pose_proposer.h"

namespace mocap::pose {

/// The pose of one bone in a pose hypothesis.
struct BonePoseHypothesis {
  Pose world;
  Dof dof = Dof::None;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();     ///< of the unobserved rotation, as in BoneProposal
  Eigen::Vector3d joint_m = Eigen::Vector3d::Zero();  ///< the joint to the bone that it was attached to, in its frame
  double joint_sigma_m = 0.0;                         ///< of the joint's position

  void archive(Archive& members) { members(world, dof, axis, joint_m, joint_sigma_m); }
};

/// The squared excess of a rotation relative to the parent over the joint's range, summed over axes, rad^2.
double squared_range_excess(const Bone& bone, const Eigen::Quaterniond& local);

/// Chooses the twist of each bone that one point observes (Dof::Swing): of kTwistSamples rotations about its axis, the
/// one with the least range excess of its own joint and of its children's joints. Unobserved bones take the rotation of
/// their parents.
void resolve_twist(const Skeleton& skeleton, std::span<BonePoseHypothesis> bones);

/// Converts world poses to local poses, as PoseFit has them.
void to_local_poses(const Skeleton& skeleton, std::span<const BonePoseHypothesis> bones, std::span<Pose> locals);

}  // namespace mocap::pose
