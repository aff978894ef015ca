#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "export/write_options.h"

namespace mocap::exports {

/// The axes of all files that are y up: right-handed, the subject faces +z in rest pose, its left hand points to +x.
/// The feed has x forward, y left, z up, so both functions permute the coordinates and are exact. A rotation becomes R
/// Q R^-1: a bone in rest pose stays parallel to the file's axes.
inline Eigen::Vector3d to_y_up(const Eigen::Vector3d& world) { return {world.y(), world.z(), world.x()}; }
inline Eigen::Quaterniond to_y_up(const Eigen::Quaterniond& world) {
  return {world.w(), world.y(), world.z(), world.x()};
}

/// A position, a direction or a rotation of the world in the axes of a file.
inline Eigen::Vector3d in_axes(const Eigen::Vector3d& v, Axes axes) { return axes == Axes::ZUp ? v : to_y_up(v); }
inline Eigen::Quaterniond in_axes(const Eigen::Quaterniond& q, Axes axes) { return axes == Axes::ZUp ? q : to_y_up(q); }

}  // namespace mocap::exports
