#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "base/result.h"
#include "cameras/replay/grey_image.h"

namespace mocap::cameras {

/// Decodes a PNG image, or a binary PGM or PPM image (P5, P6), as grey with 8 bits. Colours become luminance (ITU-R
/// BT.601: 0.299 red, 0.587 green, 0.114 blue). Of more than 8 bits the upper 8 remain; alpha is ignored.
///
/// Fails with Unsupported if the bytes are of another format, and with Io if the image is broken, cut short or has more
/// than 2^28 pixels.
Result<GreyImage> decode_grey_image(std::span<const std::byte> file);

/// Reads an image file; fails as decode_grey_image, and with Io if the file cannot be read. The message names the file.
Result<GreyImage> read_grey_image(const std::filesystem::path& file);

}  // namespace mocap::cameras
