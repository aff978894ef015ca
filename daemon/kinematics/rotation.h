#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mocap::kinematics {

/// The turn about `rotation_rad`'s direction by its length.
Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& rotation_rad);

/// The shortest turn that is this unit quaternion, as a rotation vector, rad; its length is at most pi.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

/// The shortest turn that takes one direction to another; of opposite ones, any half turn that does. Neither is 0.
///
/// Eigen's FromTwoVectors takes a singular value decomposition with it, which took compilers a minute in each file.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// How the rotation vector of a turn changes when a small turn d comes before it: from_rotation_vector(d) *
/// from_rotation_vector(phi) has the rotation vector phi + J d. This is J (the inverse of the left Jacobian of SO(3)).
///
/// Source: Barfoot, State Estimation for Robotics (2017), section 7.1.5.
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& phi);

/// The other way about, the left Jacobian of SO(3): from_rotation_vector(phi + d) = from_rotation_vector(J d) *
/// from_rotation_vector(phi) for a small d.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi);

/// The one of q and -q that is nearer to `last`: they are the same turn.
Eigen::Quaterniond same_hemisphere(const Eigen::Quaterniond& q, const Eigen::Quaterniond& last);

}  // namespace mocap::kinematics
