#pragma once

#include <bit>
#include <cstdint>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Maps grey levels over the low threshold to u of 11 bits: the high half of a 16-bit product,
/// (grey << shift) * factor >> 16.
struct Scale {
  int shift;             ///< span << shift uses all 16 bits
  std::uint32_t factor;  ///< such that the end of the span becomes 2047, or 2046 by rounding

  explicit Scale(std::uint32_t span)
      : shift(std::countl_zero(static_cast<std::uint16_t>(span))), factor((2047U << 16U) / (span << shift)) {}
};

/// Scalar loops: for processors without vector instructions, and the oracle of the vector kernels in tests.
const DetectKernels& scalar_kernels();

}  // namespace mocap::detect
