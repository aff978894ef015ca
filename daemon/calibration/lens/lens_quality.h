#pragma once

#include "calibration/lens/lens_bundle.h"

namespace mocap::calibration {

/// Standard deviation of the projection of a ray, px per axis, after the rotation of the camera that compensates best
/// where boards were seen: a rotation is estimated with the extrinsics and does no harm.
struct MappingUncertainty {
  double corner_px = 0.0;  ///< the largest in the four corners of the image
  double rim_px = 0.0;     ///< the largest on the diagonals, at the distance that boards reached
};

/// `covariance`: of the intrinsic parameters. `reach`: the distance from the image centre at which boards were seen, as
/// a fraction of that of the image corners. Infinite where a pixel has no ray.
MappingUncertainty mapping_uncertainty(const LensBundle& bundle, const IntrinsicMatrix& covariance, int width_px,
                                       int height_px, double reach);

/// Five-fold cross-validation: rms residual per axis, px, of each fifth of the boards with a lens that was fitted to
/// the others.
double cross_validate(const LensBundle& bundle, const IntrinsicMask& parameters);

}  // namespace mocap::calibration
