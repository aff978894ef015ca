#pragma once

#include <cstddef>

#include "model/frame.h"

namespace mocap::cameras {

/// Bytes of a row of pixels if rows follow each other without a gap; 0 for Mjpeg, which has no rows.
std::size_t packed_stride_bytes(PixelFormat format, int width_px);

/// Bytes of an image that are needed to read its luminance. In packed formats a row may end within a byte.
std::size_t luminance_bytes(PixelFormat format, std::size_t stride_bytes, int width_px, int height_px);

}  // namespace mocap::cameras
