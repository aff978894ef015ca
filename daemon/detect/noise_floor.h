#pragma once

#include <cstdint>

#include "model/frame.h"

namespace mocap::detect {

/// How bright and how noisy what is dark is, in the format's own levels.
struct NoiseFloor {
  double background = 0.0;
  double noise = 0.0;  ///< standard deviation
};

/// Reads the noise floor from a few hundred places of an image: all of it would cost as much as finding the blobs. The
/// same image gives the same floor. One thread.
class NoiseFloorReader {
 public:
  /// `top` is the brightest value of the format.
  explicit NoiseFloorReader(std::uint32_t top);

  /// The image is whole.
  NoiseFloor read(const Image& image);

 private:
  int shift_;  // from the format's levels to 8 bits
};

}  // namespace mocap::detect
