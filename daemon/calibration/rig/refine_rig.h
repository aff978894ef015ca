#pragma once

#include <vector>

#include "calibration/rig/fit_camera.h"

namespace mocap::calibration {

/// A marker at one instant, as several cameras saw it.
struct MarkerSight {
  int camera = 0;
  PixelPoint at;
  double sigma_px = 0.1;
};
struct SeenMarker {
  WorldPoint point;  ///< about
  std::vector<MarkerSight> sights;
};

struct RefineRigSettings {
  double usual_move_m = 0.02;  ///< a rig drifts by no more, standard deviation: holds the rig as a whole where it is
  double usual_turn_rad = 0.01;
  int threads = 2;
};

struct RefinedRig {
  Rig rig;
  double before_px = 0.0;  ///< rms per axis, robust (from the median), with the markers placed by the rig before
  double after_px = 0.0;
};

/// Moves all cameras so that markers that several of them saw agree. Lenses stay; so do place, turn and size of the rig
/// as a whole, which moving markers do not tell. Nothing for fewer than 50 markers or when no solution comes.
std::optional<RefinedRig> refine_rig(const Rig& rig, const std::vector<SeenMarker>& markers,
                                     const RefineRigSettings& settings);

}  // namespace mocap::calibration
