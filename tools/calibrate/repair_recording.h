#pragma once

#include <optional>
#include <vector>

#include "calibrate/rig_deviations.h"
#include "calibrate/terminal.h"
#include "calibration/rig/repair_rig.h"
#include "model/camera_model.h"
#include "take/recordings/blob_recording.h"

namespace mocap::calibrate {

struct RepairSettings {
  double drift_px = 1.0;  ///< a camera with a larger deviation is repaired from the others before all are adjusted
  int threads = 2;
};

struct RecordingRepair {
  Rig rig;
  std::vector<calibration::RepairedCamera> cameras;
  std::vector<calibration::KeptCamera> kept;  ///< as in calibration::RepairedRig
  std::optional<CameraBump> bump;             ///< only what followed it was used
  double before_px = 0.0;                     ///< as in calibration::RepairedRig
  double after_px = 0.0;
};

/// Repairs a rig from a recording of moving markers: calibration::repair_rig over the daemon's pipeline. If a camera
/// was bumped during the recording, only the part after the last bump is used. Fails with kExitData.
Result<RecordingRepair, Failure> repair_from_recording(const take::BlobRecording& recording, const Rig& before,
                                                       const RepairSettings& settings);

}  // namespace mocap::calibrate
