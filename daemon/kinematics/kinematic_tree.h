#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "model/points.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

/// What moves a skeleton: where its root is, and how each bone is turned against its parent (unit quaternions, by
/// bone; the root's against the world). All identity is the rest pose.
struct JointState {
  Eigen::Vector3d root_m = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> rotations;
};

/// The rest pose (T-pose) of a skeleton with its root at `root_m`.
JointState rest_state(const Skeleton& skeleton, const Eigen::Vector3d& root_m);

/// World poses of all bones, parents first. `into` and `rotations` have one element a bone; allocates nothing.
void compute_forward_kinematics(const Skeleton& skeleton, const Eigen::Vector3d& root_m,
                                std::span<const Eigen::Quaterniond> rotations, std::span<Pose> into);

/// Where a marker is, when its bone is at `world_from_bone`.
WorldPoint marker_position(const MarkerOnBone& marker, const Pose& world_from_bone);

}  // namespace mocap::kinematics
