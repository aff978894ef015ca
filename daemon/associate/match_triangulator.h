#pragma once

#include <memory>

#include "model/camera_model.h"
#include "module/triangulator.h"

namespace mocap::associate {

struct TriangulateSettings {
  double calibration_px = 0.5;  ///< standard deviation of what the rig may be wrong; tells which view is the odd one
  double agree_sigmas = 4.0;    ///< a view farther off than that is left out
  double max_sigma_m = 0.02;    ///< a point known no better than that, in its worst direction, is none
};

/// A Triangulator: linear start, then weighted least squares of the reprojection error, each blob by its own sigma_px.
///
/// A view that does not agree with the others is left out where three or more are there. Marker::covariance_m2 is what
/// the blobs' sigma_px promise, wider by what the rig showed to be off: learnt from points that four or more cameras
/// agree on, `calibration_px` at most. Never allocates after construction.
std::unique_ptr<Triangulator> make_triangulator(const TriangulateSettings& settings, Rig rig);

}  // namespace mocap::associate
