#pragma once

#include <cstdint>
#include <string_view>

#include "wire/codec/blob_flags.h"

namespace mocap::take {

// Magic bytes, version and flag bits of a blob recording (proto/mocap/v1/blobs.proto).

inline constexpr std::string_view kBlobMagic = "mocapblobs\n";
inline constexpr std::uint32_t kBlobVersion = 1;
using wire::kMerged;
using wire::kTouchesBorder;

}  // namespace mocap::take
