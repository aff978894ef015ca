#pragma once

#include <cstdint>
#include <string>

namespace mocap {

/// What became of the bright spots in one camera's images, counted.
struct DetectionCounts {
  std::uint64_t blobs = 0;  ///< found, and handed on
  // What a filter took.
  std::uint64_t too_small = 0;
  std::uint64_t too_large = 0;
  std::uint64_t not_round = 0;
  std::uint64_t too_dim = 0;
  std::uint64_t dropped = 0;        ///< over kMaxBlobs in one image
  std::uint64_t rows_given_up = 0;  ///< of pixels, full of noise

  DetectionCounts since(const DetectionCounts& before) const noexcept;
  std::uint64_t filtered() const noexcept { return too_small + too_large + not_round + too_dim; }
};

/// What a camera's detector works with, in its newest image; grey levels of 255. All 0: no image yet.
struct DetectionLevels {
  double threshold_grey = 0.0;
  double noise_grey = 0.0;
  double background_grey = 0.0;
};

/// What was left out, and by what: "212 too small, 3 not round, 40 rows of noise". Empty where nothing was.
std::string words_of_losses(const DetectionCounts& counts);

/// Why a camera that delivers shows no marker, in one line: "0 blobs in 60 images: 212 too small, 3 not round
/// (threshold 38 grey)". Empty where it shows some, or delivered no image.
std::string why_no_blobs(std::uint64_t images, const DetectionCounts& counts, const DetectionLevels& levels);

}  // namespace mocap
