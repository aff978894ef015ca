#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "calibration/wand/instants.h"
#include "model/camera_model.h"
#include "model/sighting.h"
#include "take/recordings/blob_recording.h"

namespace mocap::calibrate {

/// The result of the pipeline for one instant; borrowed for the call.
struct PipelineOutput {
  const FrameSet& frames;
  const Matches& matches;
  const Markers& markers;
  const TrackedMarkers& tracked;
};

/// The images of the recording that were exposed at one instant each, in the order of time.
std::vector<calibration::Instant> instants_of(const take::BlobRecording& recording);

/// Runs the daemon's pipeline up to 3D tracks (associate, triangulate, track) on a recording, without bounds of the
/// volume, and calls `visit` for each of instants_of(). `excluded`: cameras whose views are left out, by CameraId;
/// empty: none.
void run_pipeline(const take::BlobRecording& recording, const Rig& rig, const std::vector<bool>& excluded,
                  const std::function<void(const PipelineOutput&)>& visit);

/// The mean positions of the markers that do not move (StationaryMarkers).
std::vector<Eigen::Vector3d> stationary_markers(const take::BlobRecording& recording, const Rig& rig);

/// The positions of all markers over a walk (WalkPositions).
std::vector<Eigen::Vector3d> walk_positions(const take::BlobRecording& recording, const Rig& rig);

}  // namespace mocap::calibrate
