#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/time.h"
#include "drift/drift_watch.h"
#include "model/camera_model.h"
#include "take/recordings/blob_recording.h"

namespace mocap::calibrate {

/// Below so many (weighted) views of markers, the deviation of a camera is undetermined. Chosen by hand; not yet
/// measured.
inline constexpr double kMinViews = 100.0;

/// A camera that was bumped during a recording.
struct CameraBump {
  std::size_t camera = 0;
  Timestamp at;          ///< when it was detected
  double after_s = 0.0;  ///< the same, since the start of the recording
};

/// The deviations of all cameras from their rig.
struct RigDeviations {
  std::vector<drift::CameraDrift> drifts;  ///< by CameraId; after the last bump if there was one
  /// By CameraId: cells of the image (calibration::CoveredCells) with a view of a marker that four cameras or more see;
  /// after the last bump if there was one.
  std::vector<std::size_t> covered_cells;
  std::optional<CameraBump> bump;  ///< the last one
};

/// Whether the markers decide nothing about a camera: its views are too few, or they cover so little of its image that
/// a rotation about their rays would not show. A camera that deviates needs no coverage.
bool is_undetermined(const RigDeviations& deviations, std::size_t camera);

/// Measures the deviations with the daemon's pipeline and its drift watch. Without a bump, the whole recording counts
/// equally; with a bump, only what followed.
RigDeviations measure_deviations(const take::BlobRecording& recording, const Rig& rig, double drift_px);

/// The part of a recording from an instant on.
take::BlobRecording since(const take::BlobRecording& recording, Timestamp from);

/// The last `seconds` of a recording.
take::BlobRecording last_of(const take::BlobRecording& recording, double seconds);

}  // namespace mocap::calibrate
