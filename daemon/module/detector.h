#pragma once

#include <cstdint>

#include "model/blob.h"
#include "model/frame.h"

namespace mocap {

/// The bright spots of one image, and what was left out.
struct Detection {
  Blobs blobs;
  std::uint32_t dropped = 0;   ///< over kMaxBlobs; the largest were kept
  std::uint32_t filtered = 0;  ///< all that a filter took: the sum of the four below
  std::uint32_t too_small = 0;
  std::uint32_t too_large = 0;
  std::uint32_t not_round = 0;
  std::uint32_t too_dim = 0;
  std::uint32_t rows_given_up = 0;  ///< so full of bright runs that they are noise; their pixels were not looked at
  double threshold_grey = 0.0;      ///< in force in this image, 0 to 255
  double noise_grey = 0.0;          ///< standard deviation of the dark pixels; 0: not told
  double background_grey = 0.0;     ///< of the dark pixels; 0: not told
};

/// Finds markers in an image. One thread owns a Detector; its memory is its own scratch only: the same image gives
/// the same blobs. The image is of a format and size that the maker of the detector was told.
class Detector {
 public:
  virtual ~Detector() = default;

  virtual Detection detect(const Image& image) = 0;
};

}  // namespace mocap
