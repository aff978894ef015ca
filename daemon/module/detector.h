#pragma once

#include <cstdint>

#include "model/blob.h"
#include "model/frame.h"

namespace mocap {

/// The bright spots of one image, and what was left out.
struct Detection {
  Blobs blobs;
  std::uint32_t dropped = 0;   ///< over kMaxBlobs; the largest were kept
  std::uint32_t filtered = 0;  ///< too small, too large, not round enough
};

/// Finds markers in an image. One thread owns a Detector; its memory is its own scratch only: the same image gives
/// the same blobs. The image is of a format and size that the maker of the detector was told.
class Detector {
 public:
  virtual ~Detector() = default;

  virtual Detection detect(const Image& image) = 0;
};

}  // namespace mocap
