#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time.h"
#include "lib/retrack/span.h"

namespace mocap::retrack {

inline constexpr std::uint32_t kMostChunks = 1000;

/// A chunk of a take that is tracked in `of` chunks of equal duration. All but the first begin `overlap` before the end
/// of the chunk before them; the snapshots of these seconds are in both.
struct Chunk {
  std::uint32_t number = 0;  ///< 1 to `of`; 0: all of them
  std::uint32_t of = 0;
  Duration overlap{};
};

/// Reads "3/8". Fails with InvalidArgument.
Result<Chunk> parse_chunk(std::string_view text);
std::string to_text(const Chunk& chunk);

/// The place of a chunk, as its metadata say: "chunk 3/8 of DIGEST". `digest`: of the inputs of the joined take.
struct ChunkOrigin {
  Chunk chunk;
  std::string digest;
};
std::string to_text(const ChunkOrigin& origin);
/// Fails with InvalidArgument: this is not the origin of a chunk.
Result<ChunkOrigin> parse_origin(std::string_view text);

/// The folder of the chunks of the new take NAME.mcap: NAME.chunks.
std::filesystem::path chunk_folder(const std::filesystem::path& new_take);
/// The file of a chunk in it: 3-of-8.mcap.
std::filesystem::path chunk_file(const std::filesystem::path& new_take, const Chunk& chunk);

/// The part of a take from `first` to `last` that the chunk has. The first chunk has no beginning and the last one no
/// end. Precondition: the chunk has a number.
Span span_of(const Chunk& chunk, Timestamp first, Timestamp last);

}  // namespace mocap::retrack
