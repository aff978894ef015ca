#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "model/points.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

/// The degrees of freedom of a skeleton: position of the root, and rotation of each bone relative to its parent (unit
/// quaternions, by bone; of the root relative to the world). The identity for all bones is the rest pose.
struct JointState {
  Eigen::Vector3d root_m = Eigen::Vector3d::Zero();
  std::vector<Eigen::Quaterniond> rotations;
};

/// The rest pose (T-pose) of a skeleton with its root at `root_m`.
JointState rest_state(const Skeleton& skeleton, const Eigen::Vector3d& root_m);

/// World poses of all bones, parents first. `into` and `rotations` have one element for each bone. Allocates nothing.
void compute_forward_kinematics(const Skeleton& skeleton, const Eigen::Vector3d& root_m,
                                std::span<const Eigen::Quaterniond> rotations, std::span<Pose> into);

/// A marker nearer to the joint of its bone than this sits in the joint. It observes the position of the joint and no
/// rotation of its own bone. A bone or lever shorter than this has no direction. Marker set files place such markers
/// exactly in the joint; a fit leaves them within its numerical precision of it.
inline constexpr double kInJoint_m = 1e-3;

inline bool sits_in_joint(const MarkerOnBone& marker) { return marker.offset_m.norm() < kInJoint_m; }

/// Position of a marker whose bone has the pose `world_from_bone`.
WorldPoint marker_position(const MarkerOnBone& marker, const Pose& world_from_bone);

}  // namespace mocap::kinematics
