#pragma once

#include "calibration/lens/lens_bundle.h"

namespace mocap::calibration {

/// How sure a lens is of where rays go, px per axis, once the camera was turned to fit best where boards were.
struct MappingSigma {
  double corner_px = 0.0;  ///< in the image's corners, the worst
  double rim_px = 0.0;     ///< so far out as boards reached
};

/// `covariance`: of the lens's parts. `reach`: how far out boards were seen, of the way to the image's corners.
/// Infinite where the lens has no ray.
MappingSigma rate_mapping(const LensBundle& bundle, const LensMatrix& covariance, int width_px, int height_px,
                          double reach);

/// Rms per axis, px, of boards by lenses that were fitted without them: each fifth is left out in turn.
double leave_some_out(const LensBundle& bundle, const LensParts& parts);

}  // namespace mocap::calibration
