#pragma once

#include <cstdint>

namespace mocap::wire {

/// Bits of the column `flags` of blobs.proto and take.proto.
inline constexpr std::uint32_t kTouchesBorder = 1;
inline constexpr std::uint32_t kMerged = 2;

}  // namespace mocap::wire
