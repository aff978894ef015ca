#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace mocap::exports {

/// The axes of three rotations, 0 to 2 and all different: rotation = about axes[0] * about axes[1] * about axes[2].
using EulerOrder = std::array<int, 3>;

inline constexpr EulerOrder kZxy{2, 0, 1};  ///< the usual order of BVH
inline constexpr EulerOrder kZyx{2, 1, 0};  ///< "XYZ" of FBX, which names the innermost rotation first

/// Returns the Euler angles of a rotation, rad, in the order of `order`. Of the equivalent solutions, returns the one
/// nearest to `before`, the angles of the previous frame, so that the curves have no jumps of a full turn. In gimbal
/// lock the third angle stays as it was.
///
/// Source: Shoemake, Euler angle conversion, Graphics Gems IV (1994), for the Tait-Bryan angles of any order.
Eigen::Vector3d euler_angles(const Eigen::Quaterniond& rotation, const EulerOrder& order,
                             const Eigen::Vector3d& before);

}  // namespace mocap::exports
