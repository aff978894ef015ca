#pragma once

#include <memory>

#include "associate/triangulate_settings.h"
#include "model/camera_model.h"
#include "module/triangulator.h"

namespace mocap::associate {

/// A Triangulator: linear start, then weighted least squares of the reprojection error, each blob by its own sigma_px.
///
/// A view that does not agree with the others is left out where three or more are there. Marker::covariance_m2 is what
/// the blobs' sigma_px promise, wider by what the rig showed to be off: learnt from points that four or more cameras
/// agree on, `calibration_px` at most. Never allocates after construction.
std::unique_ptr<Triangulator> make_triangulator(const TriangulateSettings& settings, Rig rig);

}  // namespace mocap::associate
