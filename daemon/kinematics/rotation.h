#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mocap::kinematics {

/// The rotation about the direction of `rotation_rad` by its length (the exponential map of SO(3)).
Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& rotation_rad);

/// The rotation vector of a unit quaternion, rad; its length is at most pi (the logarithm map of SO(3)).
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

/// The shortest rotation that takes one direction to another; for opposite directions, one of the half turns that do.
/// Neither vector is 0.
///
/// Replaces Eigen's FromTwoVectors, which compiles a singular value decomposition into each file: a minute of compile
/// time.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The inverse of the left Jacobian J of SO(3) at phi: for a small d, from_rotation_vector(d) *
/// from_rotation_vector(phi) has the rotation vector phi + J^-1 d.
///
/// Source: Barfoot, State Estimation for Robotics (2017), section 7.1.5.
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& phi);

/// The left Jacobian J of SO(3) at phi: for a small d, from_rotation_vector(phi + d) = from_rotation_vector(J d) *
/// from_rotation_vector(phi).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi);

/// The one of q and -q that is nearer to `last`: both are the same rotation.
Eigen::Quaterniond same_hemisphere(const Eigen::Quaterniond& q, const Eigen::Quaterniond& last);

}  // namespace mocap::kinematics
