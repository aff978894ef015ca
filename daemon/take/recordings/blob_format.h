#pragma once

#include <cstdint>
#include <string_view>

namespace mocap::take {

// Magic bytes and version of a blob recording (proto/mocap/v1/blobs.proto).

inline constexpr std::string_view kBlobMagic = "mocapblobs\n";
inline constexpr std::uint32_t kBlobVersion = 1;

}  // namespace mocap::take
