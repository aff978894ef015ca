#pragma once

#include <cstdint>
#include <string_view>

namespace mocap::take {

// Magic bytes, version and flag bits of a blob recording (proto/mocap/v1/blobs.proto).

inline constexpr std::string_view kBlobMagic = "mocapblobs\n";
inline constexpr std::uint32_t kBlobVersion = 1;
inline constexpr std::uint32_t kTouchesBorder = 1;
inline constexpr std::uint32_t kMerged = 2;

}  // namespace mocap::take
