#pragma once

#include <cstddef>
#include <vector>

namespace mocap::cameras {

/// An image in memory: one byte per pixel, rows from top to bottom without gaps.
struct GreyImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::byte> pixels;
};

}  // namespace mocap::cameras
