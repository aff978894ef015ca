#pragma once

#include <cstddef>

#include "model/frame.h"

namespace mocap::cameras {

/// How many bytes a row takes where rows follow without a gap; 0 for Mjpeg, which has no rows.
std::size_t packed_stride_bytes(PixelFormat format, int width_px);

/// How many bytes an image takes that must be there to read its luminance; packed formats run on over the ends of rows.
std::size_t luminance_bytes(PixelFormat format, std::size_t stride_bytes, int width_px, int height_px);

}  // namespace mocap::cameras
