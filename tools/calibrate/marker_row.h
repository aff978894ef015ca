#pragma once

#include <functional>
#include <vector>

#include "model/camera_model.h"
#include "model/sighting.h"
#include "take/blob_recording.h"

namespace mocap::calibrate {

/// One instant of a recording, as the daemon's row sees it; borrowed.
struct RowLook {
  const FrameSet& frames;
  const Matches& matches;
  const Markers& markers;
  const TrackedMarkers& tracked;
};

/// Runs a recording through the daemon's row, up to 3D tracks, in a world without bounds. `without`, by camera: whose
/// views are left out; empty: nobody's.
void run_row(const take::BlobRecording& recording, const Rig& rig, const std::vector<bool>& without,
             const std::function<void(const RowLook&)>& look);

/// A marker that lay still: its mean place.
struct StillMarker {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  std::size_t sets = 0;  ///< that saw it
};

/// What lay still over at least half of a recording (and a second), to 3 mm.
std::vector<StillMarker> still_markers(const take::BlobRecording& recording, const Rig& rig);

/// Every place in which three cameras or more saw a marker, thinned out to some thousands.
std::vector<Eigen::Vector3d> marker_places(const take::BlobRecording& recording, const Rig& rig);

}  // namespace mocap::calibrate
