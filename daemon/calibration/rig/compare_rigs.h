#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"
#include "model/transform.h"

namespace mocap::calibration {

/// How the frames of two rigs are aligned before they are compared.
enum class RigAlignment {
  AllCameras,     ///< least squares over all cameras: errors against a known truth
  RobustToMoved,  ///< robust: cameras that moved against the others have little weight
};

/// The change of one camera between two rigs.
struct CameraChange {
  std::string name;
  double position_m = 0.0;    ///< after the alignment
  double rotation_rad = 0.0;  ///< after the alignment
  double raw_position_m = 0.0;
  double raw_rotation_rad = 0.0;
  double focal_change = 0.0;  ///< relative change of the focal length; that of fx or fy, whichever is larger
  /// Rms displacement in the image of points in the volume in front of the cameras; nothing if none of them is in front
  /// of the camera in both rigs: it was turned away.
  std::optional<double> image_px;
};

struct RigChange {
  std::vector<CameraChange> cameras;  ///< those in both rigs, in the order of the new one
  std::vector<std::string> only_old;
  std::vector<std::string> only_new;
  Pose old_from_new;               ///< the alignment
  double position_m = 0.0;         ///< rms over the cameras, after the alignment
  double rotation_rad = 0.0;       ///< the same
  double scale = 1.0;              ///< extent of the new camera centres over that of the old ones
  double world_moved_m = 0.0;      ///< translation of the world frame
  double world_rotated_rad = 0.0;  ///< rotation of the world frame
};

/// Compares two rigs; cameras correspond by name. Fails with InvalidArgument if fewer than two cameras are in both, or
/// if all cameras of a rig are at one place: it has no poses.
Result<RigChange> compare_rigs(const Rig& old_rig, const Rig& new_rig, RigAlignment alignment);

}  // namespace mocap::calibration
