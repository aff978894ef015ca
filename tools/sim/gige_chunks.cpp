#include "gige_chunks.h"

#include <endian.h>

#include <bit>
#include <cstring>

#include "gige_features.h"

namespace mocap::sim {
namespace {

constexpr std::uint32_t kImageChunk = 0x1;
constexpr std::size_t kTagBytes = 8;    // chunk id and length
constexpr std::size_t kValueBytes = 8;  // all our chunks have this length

template <class T>
void append(std::vector<std::byte>& to, T net) {
  std::byte raw[sizeof net];
  std::memcpy(raw, &net, sizeof net);
  to.insert(to.end(), std::begin(raw), std::end(raw));
}

void append_tag(std::vector<std::byte>& to, std::uint32_t id, std::size_t bytes) {
  append(to, htobe32(id));
  append(to, htobe32(static_cast<std::uint32_t>(bytes)));
}

void append_chunk(std::vector<std::byte>& to, std::uint32_t id, std::uint64_t value) {
  append(to, htobe64(value));
  append_tag(to, id, kValueBytes);
}

}  // namespace

std::size_t chunk_bytes(const WantedChunks& wanted) {
  const std::size_t chunks = std::size_t{wanted.timestamp} + wanted.exposure + wanted.frame_id;
  return kTagBytes + chunks * (kTagBytes + kValueBytes);
}

std::vector<std::byte> chunks_behind(const ServedImage& image, std::size_t image_bytes, const WantedChunks& wanted) {
  std::vector<std::byte> all;
  all.reserve(chunk_bytes(wanted));
  append_tag(all, kImageChunk, image_bytes);
  if (wanted.timestamp) append_chunk(all, kTimestampChunk, image.chunk_stamp_ns);
  if (wanted.exposure) append_chunk(all, kExposureChunk, std::bit_cast<std::uint64_t>(image.exposure_us));
  if (wanted.frame_id) append_chunk(all, kFrameIdChunk, image.id);
  return all;
}

}  // namespace mocap::sim
