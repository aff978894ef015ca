#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "model/camera_model.h"

namespace mocap::geometry {

/// The part of a camera that a value belongs to.
enum class RigPart { Matrix, Translation };

/// A value that no real rig has: it is probably in another unit.
struct ImplausibleValue {
  std::size_t camera = 0;  ///< index in the rig
  RigPart part = RigPart::Matrix;
  std::string message;  ///< value, expected range and remedy, without the camera's name
};

/// The values of a rig that are implausible: positions in millimetres, two cameras at one place, focal lengths in
/// millimetres, opening angles, principal points far outside the image. Cameras with the identity pose have no pose yet
/// (a file of lenses). Cameras with a size or focal length that is not positive are skipped: they have another fault.
std::vector<ImplausibleValue> implausible_values(const Rig& rig);

/// The fault of a rotation vector (Rodrigues) that is longer than pi: degrees instead of radians, or a rotation of more
/// than half a turn. Nothing for a plausible one.
std::optional<std::string> rotation_vector_fault(const Eigen::Vector3d& rotation_rad);

}  // namespace mocap::geometry
