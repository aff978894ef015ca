#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "model/frame.h"

namespace mocap::detect {

// How the bytes of each format become grey levels.

/// The brightest value that a format has; 0 for those without rows (Mjpeg).
std::uint32_t top_of(PixelFormat format);

/// Bytes of a pixel that can be compared where it lies; 0 for formats that must be unpacked first.
std::size_t bytes_in_place(PixelFormat format);
/// The bits of a pixel in place that count.
std::uint16_t kept_bits(PixelFormat format);

/// Whether the image holds all the bytes that its size, stride and format promise.
bool is_whole(const Image& image);

/// Reads the pixels from x on in row y, one for each of `grey`, in the format's own levels. The image is whole and the
/// pixels lie within it.
///
/// Bayer: the green light at every site; where a site is red or blue, the mean of its green neighbours.
void read_pixels(const Image& image, int y, int x, std::span<std::uint16_t> grey);

}  // namespace mocap::detect
