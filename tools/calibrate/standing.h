#pragma once

#include <optional>
#include <vector>

#include "base/time.h"
#include "drift/drift_watch.h"
#include "model/camera_model.h"
#include "take/blob_recording.h"

namespace mocap::calibrate {

/// A camera that was bumped while a take was made.
struct MovedMeanwhile {
  std::size_t camera = 0;
  Timestamp at;          ///< it was seen by then
  double after_s = 0.0;  ///< since the take began
};

/// How the cameras stood while markers moved.
struct Standing {
  std::vector<drift::CameraDrift> drifts;  ///< by camera; where one was bumped meanwhile, as they stood afterwards
  std::optional<MovedMeanwhile> moved;     ///< the last
};

Standing standing_of(const take::BlobRecording& recording, const Rig& rig, double drift_px);

/// What was seen from then on.
take::BlobRecording since(const take::BlobRecording& recording, Timestamp from);

/// The last `seconds` of a recording.
take::BlobRecording last_of(const take::BlobRecording& recording, double seconds);

}  // namespace mocap::calibrate
