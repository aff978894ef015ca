#pragma once

#include <cstdint>
#include <span>

#include "model/frame.h"

namespace mocap::detect {

/// Copies every step-th pixel of every step-th row to `grey`, as 8-bit grey levels, row by row. The image is whole, and
/// `grey` has room.
void decimate(const Image& image, int step, std::span<std::uint8_t> grey);

}  // namespace mocap::detect
