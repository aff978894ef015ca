#pragma once

#include <cstddef>
#include <vector>

#include "calibration/bundle.h"
#include "calibration/wand/wand_detections.h"

namespace mocap::calibration {

struct WandPoseSettings {
  double gate_px = 3.0;  ///< largest distance of a blob from the projection of its marker
  std::size_t max_samples = 1000;
  std::size_t burst = 1;     ///< so many consecutive samples stay together if a recording is thinned out
  int excluded_camera = -1;  ///< its views are observations but do not take part in the triangulation; -1: none
};

/// The instants at which two cameras or more, without the excluded one, detected the wand, in ascending order. More
/// than `max_samples` are thinned out: bursts of consecutive instants, evenly over the recording.
std::vector<std::size_t> sample_instants(const WandDetections& detections, const WandPoseSettings& settings);

/// Triangulates the wand at each of the sample_instants with the cameras of `bundle` and assigns blobs to its markers:
/// also in images in which the wand was not detected by itself. Replaces the wand poses and the observations of
/// `bundle`.
void triangulate_wand_poses(const WandDetections& detections, Bundle& bundle, const WandPoseSettings& settings);

/// Removes outlier observations: those without a residual, or with a residual above kOutlierSigmas robust standard
/// deviations. Returns how many were removed.
std::size_t remove_outliers(Bundle& bundle);

}  // namespace mocap::calibration
