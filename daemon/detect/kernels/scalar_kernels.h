#pragma once

#include <bit>
#include <cstdint>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// How grey levels over the low threshold become u of 11 bits: the high half of a product of 16 bits,
/// (grey << shift) * factor >> 16.
struct Scale {
  int shift;             ///< span << shift has all 16 bits
  std::uint32_t factor;  ///< 2047 at the end of the span

  explicit Scale(std::uint32_t span)
      : shift(std::countl_zero(static_cast<std::uint16_t>(span))), factor((2047U << 16U) / (span << shift)) {}
};

/// Plain loops: for processors without any of the vector sets, and the oracle of those.
const DetectKernels& scalar_kernels();

}  // namespace mocap::detect
