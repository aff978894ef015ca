#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gvsp_stream.h"

namespace mocap::sim {

/// Which chunks a client wants behind each image.
struct WantedChunks {
  bool timestamp = false, exposure = false, frame_id = false;
};

std::size_t chunk_bytes(const WantedChunks& wanted);

/// What follows the image's pixels: the image's own tag, then each chunk with its tag behind it, all big-endian.
///
/// Source: GigE Vision 2.0, part "GVSP" (chunk data payload).
std::vector<std::byte> chunks_behind(const ServedImage& image, std::size_t image_bytes, const WantedChunks& wanted);

}  // namespace mocap::sim
