#pragma once

#include "model/camera_model.h"

namespace mocap::calibration {

/// The rig before a calibration: the same cameras in the same order.
struct RigBefore {
  Rig rig;
  bool floor_is_guessed = false;  ///< its world frame is provisional: its floor was never measured
};

}  // namespace mocap::calibration
