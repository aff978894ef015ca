#pragma once

#include <memory>

#include "associate/triangulate_settings.h"
#include "model/camera_model.h"
#include "module/triangulator.h"

namespace mocap::associate {

/// Makes a Triangulator: linear triangulation, then weighted least squares of the reprojection error with the sigma_px
/// of each blob (Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), chapter 12), with removal of outlier
/// views if three or more are present. A match that carries its point (Match::triangulation) is not solved again.
///
/// Marker::covariance_m2 is the covariance from the blobs' sigma_px, increased by the rig error that is learned from
/// points with four or more cameras, at most `calibration_px`. Never allocates after construction.
std::unique_ptr<Triangulator> make_triangulator(const TriangulateSettings& settings, Rig rig);

}  // namespace mocap::associate
