#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"
#include "model/transform.h"

namespace mocap::calibration {

/// How the frames of two rigs are brought together before they are compared.
enum class RigAlignment {
  AllCameras,  ///< over all cameras alike, as errors against a truth are told
  MostStayed,  ///< over those that stayed: a camera that was bumped does not pull the others along
};

/// How one camera stands in the other rig.
struct CameraChange {
  std::string name;
  double position_m = 0.0;      ///< after alignment
  double rotation_rad = 0.0;    ///< likewise
  double raw_position_m = 0.0;  ///< as the files have it
  double raw_rotation_rad = 0.0;
  double focal_share = 0.0;  ///< new over old, less one; the worse of both axes
  double image_px = 0.0;     ///< root mean square of how far points before all cameras lie apart in its image
};

struct RigChange {
  std::vector<CameraChange> cameras;  ///< those that are in both, in the order of the new one
  std::vector<std::string> only_old;
  std::vector<std::string> only_new;
  Pose old_from_new;            ///< the alignment
  double position_m = 0.0;      ///< root of the mean square over cameras, after alignment
  double rotation_rad = 0.0;    ///< likewise
  double scale = 1.0;           ///< spread of the new centres over that of the old
  double frame_moved_m = 0.0;   ///< how far the world's origin moved
  double frame_turned_rad = 0;  ///< and turned
};

/// Compares cameras by their names. Fails with InvalidArgument where fewer than two are in both.
Result<RigChange> compare_rigs(const Rig& old_rig, const Rig& new_rig, RigAlignment alignment);

}  // namespace mocap::calibration
