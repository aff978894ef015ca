#pragma once

#include <string>
#include <string_view>

namespace mocap::rokoko {

/// `text` as one LZ4 frame with the size of its content, as Rokoko Studio sends it. Empty if liblz4 fails, which it
/// does only without memory.
std::string lz4_frame(std::string_view text);

}  // namespace mocap::rokoko
