#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// A disc of light with a blurred edge: the grey level at distance d from the centre is
/// background + height * Phi((radius - d) / edge), with the normal distribution function Phi, clipped at the top of the
/// range.
struct SoftDisc {
  double x = 0.0, y = 0.0;  ///< centre, px from the box's first pixel
  double radius_px = 0.0;
  double edge_px = 0.0;  ///< standard deviation of the blur by lens and pixel
  double height = 0.0;   ///< above the background, in the image's levels; beyond the range if saturated
};

struct FittedDisc {
  SoftDisc disc;
  double sigma_px = 0.0;  ///< standard deviation of the centre, each axis, from noise and model residuals
};

/// Known grey levels of the image.
struct DiscFitLevels {
  std::uint32_t top = 255;  ///< the largest value of the format
  double background = 0.0;
  double noise = 1.0;  ///< standard deviation
};

/// Fits a disc to the rim of a saturated blob. `start` has its centre and radius within about half a pixel.
///
/// Damped Gauss-Newton on five unknowns (centre, radius, blur, height) with a bounded number of iterations. A saturated
/// pixel contributes only if the model is below the top of the range. The same pixels give the same disc on every
/// processor. Empty if the fit does not converge near the start, or if its residuals are too large: the blob is
/// streaked, cut, or several discs.
///
/// `width_px` columns of the box belong to the image; a pixel of 0 belongs to another blob. Some microseconds for a
/// radius of 8 px. Never allocates.
std::optional<FittedDisc> fit_disc(const Box& box, int width_px, const DiscFitLevels& levels, const SoftDisc& start);

}  // namespace mocap::detect
