#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "take/mcap/decode_records.h"
#include "take/mcap/records.h"

namespace mocap::take::mcap {

/// A bound on the records of one chunk and on one attachment, compressed or not: what a file can make a reader
/// allocate.
inline constexpr std::uint64_t kMaxRecord_bytes = 256 * 1024 * 1024;

/// The place of one message in uncompressed records.
struct MessagePlace {
  std::uint64_t log_time_ns = 0;
  std::uint64_t offset = 0;
  std::uint16_t channel_id = 0;
};

/// The uncompressed records of a chunk, checked.
struct ChunkContent {
  std::string records;
  std::vector<Schema> schemas;
  std::vector<Channel> channels;
  std::vector<MessagePlace> messages;  ///< in the order of the file

  /// Precondition: `place` is one of `messages`.
  Message message(const MessagePlace& place) const;

  /// The messages by channel.
  std::vector<MessageIndex> indexes() const;
};

/// Reads a chunk's record. Fails with InvalidArgument and Unsupported if the records are larger than kMaxRecord_bytes,
/// cannot be uncompressed, have another checksum, or are not whole records; the message names the byte.
Result<ChunkContent> read_chunk(const RawRecord& record);

/// Reads uncompressed records; `offset` is the position of the chunk, for messages. Fails with InvalidArgument.
Result<ChunkContent> read_records(std::string records, std::uint64_t offset);

}  // namespace mocap::take::mcap
