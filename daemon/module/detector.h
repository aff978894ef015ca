#pragma once

#include <cstdint>

#include "model/blob.h"
#include "model/frame.h"

namespace mocap {

/// The blobs of one image, and the counts of what the detector left out.
struct Detection {
  Blobs blobs;
  std::uint32_t dropped = 0;   ///< blobs beyond kMaxBlobs; the largest blobs were kept
  std::uint32_t filtered = 0;  ///< blobs that a filter rejected: the sum of the next four
  std::uint32_t too_small = 0;
  std::uint32_t too_large = 0;
  std::uint32_t not_round = 0;
  std::uint32_t too_dim = 0;
  std::uint32_t rows_given_up = 0;  ///< image rows with so many bright runs that the detector skipped their pixels
  double threshold_grey = 0.0;      ///< the threshold of this image, 0 to 255
  double noise_grey = 0.0;          ///< standard deviation of the dark pixels; 0: not estimated
  double background_grey = 0.0;     ///< mean of the dark pixels; 0: not estimated
};

/// Finds the blobs of an image. The same image gives the same blobs: a detector has no memory of earlier images.
///
/// One thread owns a Detector and makes all calls.
class Detector {
 public:
  virtual ~Detector() = default;

  /// `image` has the size and the pixel format for which the detector was made.
  virtual Detection detect(const Image& image) = 0;

  /// The brightest pixel that no mask covers, 0 to 255; 0: unknown. For images without blobs: reads the whole image
  /// again, so that the caller calls it a few times a second only.
  virtual double brightest_grey(const Image& /*image*/) { return 0.0; }
};

}  // namespace mocap
