#pragma once

#include <cstdint>

#include "model/frame.h"

namespace mocap::detect {

/// Level and noise of an image's background, in the levels of the pixel format.
struct NoiseFloor {
  double background = 0.0;  ///< mean
  double noise = 0.0;       ///< standard deviation
};

/// Returns the level from which a pixel belongs to a marker: 8 standard deviations of the noise over the background,
/// and at least 20/255 of the range. `top` is the brightest level of the format. The level may lie above `top`.
double marker_threshold(const NoiseFloor& floor, double top);

/// Estimates the noise floor of an image from 512 pixels: 32 places of 16 neighbouring pixels each.
///
/// Lamps, windows and sunlit walls are brighter than the background and may cover most of an image. The estimate
/// therefore has three steps:
///
/// 1. Choose the brightest level of the background in the histogram. Each level splits the pixels into background and
///    clutter, and the background gives a marker threshold. The chosen level maximises the share of background pixels
///    times (1 - threshold^2), the share of marker brightness that remains detectable. Clutter counts as background
///    only if most of the range remains for the markers. As in Otsu (1979), the split maximises a criterion over all
///    levels.
/// 2. Estimate the background and its spread from the median and the upper quartile of the pixels up to that level.
/// 3. Reweight: take mean and standard deviation of the pixels that are consistent with step 2, and leave out each
///    place of which more than half is brighter. Step 3 restores the efficiency of the least-squares estimate after a
///    start with a high breakdown point (Rousseeuw and Leroy 1987, chapter 1).
///
/// The same image gives the same noise floor. Never allocates. One thread.
///
/// Sources: N. Otsu, "A threshold selection method from gray-level histograms", IEEE Trans. SMC 9 (1979) 62-66;
/// P. J. Rousseeuw and A. M. Leroy, "Robust Regression and Outlier Detection", Wiley (1987).
class NoiseFloorReader {
 public:
  /// `top` is the brightest level of the format.
  explicit NoiseFloorReader(std::uint32_t top);

  /// Precondition: is_whole(image).
  NoiseFloor read(const Image& image) const;

 private:
  int shift_;  // from the levels of the format to 8 bits
};

}  // namespace mocap::detect
