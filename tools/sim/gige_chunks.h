#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gvsp_stream.h"

namespace mocap::sim {

/// The chunks that the client has enabled.
struct WantedChunks {
  bool timestamp = false, exposure = false, frame_id = false;
};

/// Number of bytes that chunks_behind() returns.
std::size_t chunk_bytes(const WantedChunks& wanted);

/// The bytes after the pixels: the tag of the image chunk, then each chunk followed by its tag, all big-endian.
///
/// Source: GigE Vision 2.0, part "GVSP" (chunk data payload).
std::vector<std::byte> chunks_behind(const ServedImage& image, std::size_t image_bytes, const WantedChunks& wanted);

}  // namespace mocap::sim
