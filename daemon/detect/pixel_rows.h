#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/frame.h"

namespace mocap::detect {

// Conversion of each pixel format's bytes to grey levels.

/// The largest value of a format; 0 for a format without rows (Mjpeg).
std::uint32_t top_of(PixelFormat format);

/// Bytes of a pixel that can be compared in place; 0 for a packed format.
std::size_t bytes_in_place(PixelFormat format);
/// The significant bits of a pixel that is compared in place.
std::uint16_t kept_bits(PixelFormat format);

/// Whether the image has all bytes that its size, stride and format require.
bool is_whole(const Image& image);

/// Reads the pixels of row y from x on, one for each element of `grey`, in the format's own levels. The image is whole
/// and contains these pixels.
///
/// Bayer: green at every site; at a red or blue site, the mean of its green neighbours.
void read_pixels(const Image& image, int y, int x, std::span<std::uint16_t> grey);

}  // namespace mocap::detect
