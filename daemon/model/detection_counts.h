#pragma once

#include <cstdint>
#include <string>

namespace mocap {

/// Counts of one camera's components: accepted as blobs, or rejected and why.
struct DetectionCounts {
  std::uint64_t blobs = 0;  ///< accepted
  // Rejected by a filter.
  std::uint64_t too_small = 0;
  std::uint64_t too_large = 0;
  std::uint64_t not_round = 0;
  std::uint64_t too_dim = 0;
  std::uint64_t dropped = 0;        ///< over kMaxBlobs in one image
  std::uint64_t rows_given_up = 0;  ///< rows of pixels dropped as noise storms

  DetectionCounts since(const DetectionCounts& before) const noexcept;
  std::uint64_t filtered() const noexcept { return too_small + too_large + not_round + too_dim; }
};

/// Thresholds and noise of a camera's newest image, in grey levels 0 to 255. All 0: no image yet.
struct DetectionLevels {
  double threshold_grey = 0.0;
  double noise_grey = 0.0;
  double background_grey = 0.0;
  double brightest_grey = 0.0;  ///< brightest unmasked pixel of the newest measured image without a blob; 0: unknown
};

/// The rejected components by reason: "212 too small, 3 not round, 40 rows of noise". Empty if none was rejected.
std::string words_of_losses(const DetectionCounts& counts);

/// Why a camera that delivers images has no blobs, in one line: "0 blobs in 60 images: 212 too small, 3 not round
/// (threshold 38 grey)". Empty if there are blobs, or no images.
std::string why_no_blobs(std::uint64_t images, const DetectionCounts& counts, const DetectionLevels& levels);

}  // namespace mocap
