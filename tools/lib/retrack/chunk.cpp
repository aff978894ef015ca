#include "lib/retrack/chunk.h"

#include <fmt/format.h>

#include <charconv>

#include "base/expects.h"

namespace mocap::retrack {
namespace {

constexpr std::string_view kChunkWord = "chunk ", kOfWord = " of ";

// Nothing but a number. 0: the text is none.
std::uint32_t number_in(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? number : 0;
}

// Where chunk `number` ends.
Timestamp end_of(std::uint32_t number, std::uint32_t of, Timestamp first, Timestamp last) {
  const Duration each = (last - first) / of, rest = (last - first) % of;
  return first + each * number + rest * number / of;
}

}  // namespace

Result<Chunk> parse_chunk(std::string_view text) {
  const std::size_t slash = text.find('/');
  Chunk chunk;
  if (slash != std::string_view::npos) {
    chunk.number = number_in(text.substr(0, slash));
    chunk.of = number_in(text.substr(slash + 1));
  }
  if (chunk.number >= 1 && chunk.number <= chunk.of && chunk.of <= kMostChunks) return chunk;
  return Error{ErrorCode::InvalidArgument,
               fmt::format("chunk '{}': expected NUMBER/ALL, such as 3/8, with at most {} chunks", text, kMostChunks)};
}

std::string to_text(const Chunk& chunk) { return fmt::format("{}/{}", chunk.number, chunk.of); }

std::string to_text(const ChunkOrigin& origin) {
  return fmt::format("{}{}{}{}", kChunkWord, to_text(origin.chunk), kOfWord, origin.digest);
}

Result<ChunkOrigin> parse_origin(std::string_view text) {
  const std::size_t of = text.find(kOfWord);
  if (!text.starts_with(kChunkWord) || of == std::string_view::npos) {
    return Error{ErrorCode::InvalidArgument, "is no chunk"};
  }
  const Result<Chunk> chunk = parse_chunk(text.substr(kChunkWord.size(), of - kChunkWord.size()));
  if (!chunk) return chunk.error();
  return ChunkOrigin{*chunk, std::string(text.substr(of + kOfWord.size()))};
}

std::filesystem::path chunk_folder(const std::filesystem::path& new_take) {
  return new_take.parent_path() / (new_take.stem().string() + ".chunks");
}

std::filesystem::path chunk_file(const std::filesystem::path& new_take, const Chunk& chunk) {
  return chunk_folder(new_take) / fmt::format("{}-of-{}.mcap", chunk.number, chunk.of);
}

Span span_of(const Chunk& chunk, Timestamp first, Timestamp last) {
  MOCAP_EXPECTS(chunk.number >= 1 && chunk.number <= chunk.of);
  Span span;
  if (chunk.number > 1) span.from = end_of(chunk.number - 1, chunk.of, first, last) - chunk.overlap;
  if (chunk.number < chunk.of) span.to = end_of(chunk.number, chunk.of, first, last);
  return span;
}

}  // namespace mocap::retrack
