#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calibration/rig/resect_camera.h"

namespace mocap::calibration {

/// The image of a marker in one camera.
struct MarkerObservation {
  int camera = 0;  ///< index in the rig
  PixelPoint at;
  double sigma_px = 0.1;  ///< standard deviation per axis
};

/// One marker at one instant.
struct ObservedMarker {
  WorldPoint point;  ///< initial position
  std::vector<MarkerObservation> observations;
};

/// Fewer markers do not determine a rig. Chosen by hand; not yet measured.
inline constexpr std::size_t kMinRefinedMarkers = 50;

struct RefineRigSettings {
  /// Standard deviations of the prior on each camera's pose. The prior fixes the gauge: position, rotation and scale of
  /// the rig as a whole. Chosen by hand: several times the drift of a rig.
  double position_prior_m = 0.02;
  double rotation_prior_rad = 0.01;
  int threads = 2;
};

struct RefinedRig {
  Rig rig;
  double before_px = 0.0;  ///< robust rms per axis (from the median), of the initial rig and marker positions
  double after_px = 0.0;   ///< the same after the adjustment
};

/// Bundle adjustment of the extrinsics of all cameras and of the markers' positions; intrinsics are constant. Markers
/// that move freely determine neither position, rotation nor scale of the rig as a whole: the prior keeps them. Nothing
/// for fewer than kMinRefinedMarkers markers, or if Ceres finds no solution.
///
/// Source: Triggs et al., "Bundle adjustment - a modern synthesis" (2000).
std::optional<RefinedRig> refine_rig(const Rig& rig, const std::vector<ObservedMarker>& markers,
                                     const RefineRigSettings& settings);

}  // namespace mocap::calibration
