#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// A disc of light with a soft edge: the grey level at distance d from its middle is
/// background + height * Phi((radius - d) / edge), Phi the normal distribution, and nowhere over the top of
/// the range.
struct SoftDisc {
  double x = 0.0, y = 0.0;  ///< of its middle, px from the box's first pixel
  double radius_px = 0.0;
  double edge_px = 0.0;  ///< standard deviation of the blur of lens and pixel together
  double height = 0.0;   ///< over the background, in the image's levels; beyond the range where it saturates
};

struct FittedDisc {
  SoftDisc disc;
  double sigma_px = 0.0;  ///< standard deviation of the middle, each axis, by noise and by what the model leaves
};

/// What is known before a disc is fitted.
struct DiscFitLevels {
  std::uint32_t top = 255;  ///< the brightest value of the format
  double background = 0.0;
  double noise = 1.0;  ///< standard deviation
};

/// Fits a disc to the rim of a saturated blob, `start` being its middle and radius within half a pixel or so.
///
/// A pixel at the top of the range counts only where the model stays below. Gauss-Newton on five unknowns, damped, a
/// bounded number of rounds; the blur is unknown too, since no two lenses have the same. The same pixels give the same
/// disc on every processor. Nothing, where the fit does not settle near the start or leaves too much: the blob is no
/// disc, but drawn out, cut, or several.
///
/// `width_px` columns of the box belong to the image; a pixel of 0 belongs to another blob. Some microseconds for a
/// radius of 8 px. Never allocates.
std::optional<FittedDisc> fit_disc(const Box& box, int width_px, const DiscFitLevels& levels, const SoftDisc& start);

}  // namespace mocap::detect
