#pragma once

#include <chrono>
#include <vector>

#include "calibration/wand/wand_recording.h"

namespace mocap::calibration {

/// Largest difference of the exposure times of the images of one instant. At 2 m/s a marker moves 10 mm in 5 ms; free
/// running cameras at 100 Hz and more still find a partner for each image. Chosen by hand.
inline constexpr Duration kMaxSkew = std::chrono::milliseconds(5);

/// The images that were exposed at one instant.
struct Instant {
  Timestamp at;            ///< exposure of the first image
  std::vector<int> image;  ///< index of the image by camera; -1: the camera has none
};

/// The median time between two images of the camera with the most images; 0 if no camera has two.
Duration frame_period(const Take& recording);

/// Groups the images of all cameras by exposure time. An image joins an instant if it was exposed within half a frame
/// period (or within `max_skew` if that is less) after the first image of the instant.
std::vector<Instant> group_by_instant(const Take& recording, Duration max_skew);

}  // namespace mocap::calibration
