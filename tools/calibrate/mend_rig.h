#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/say.h"
#include "calibrate/standing.h"
#include "model/camera_model.h"
#include "take/blob_recording.h"

namespace mocap::calibrate {

struct MendSettings {
  double drift_px = 1.0;  ///< a camera that is off by more is mended from the others first
  int threads = 2;
};

/// A camera that was put where the others see it stand.
struct MendedCamera {
  std::string name;
  double turned_rad = 0.0;
  double moved_m = 0.0;
};

struct MendedRig {
  Rig rig;
  std::vector<MendedCamera> cameras;
  std::optional<MovedMeanwhile> moved;  ///< only what was seen after it counts
  double before_px = 0.0;               ///< rms per axis, robust, after cameras that were bumped are mended
  double after_px = 0.0;
};

/// Puts cameras that were bumped where the others see them stand, then moves all of them until moving markers agree.
/// Fails where there is too little to tell, where more than half of the cameras stand otherwise, and where no turn and
/// move explains what one sees.
Result<MendedRig, Failure> mend_rig(const take::BlobRecording& recording, const Rig& before,
                                    const MendSettings& settings);

}  // namespace mocap::calibrate
