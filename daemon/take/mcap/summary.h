#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "take/mcap/records.h"

namespace mocap::take::mcap {

/// The index of a file: what is in the data section, and where.
struct Summary {
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  std::vector<ChunkIndex> chunks;
  std::vector<AttachmentIndex> attachments;
  std::vector<MetadataIndex> metadata;
  Statistics statistics;

  void add(const Schema& schema);
  void add(const Channel& channel);
  /// Adds a chunk and its messages to the statistics.
  void add(const ChunkIndex& chunk, std::span<const MessageIndex> messages);
  void add(const AttachmentIndex& attachment);
  void add(const MetadataIndex& metadata);
};

/// The end of a file whose data section has `data_bytes` bytes (with the first magic) and the checksum `data_crc`: the
/// DataEnd, the summary, its offsets, the footer and the magic.
std::string encode_file_end(const Summary& summary, std::uint64_t data_bytes, std::uint32_t data_crc);

/// Decodes the records of a summary section and of a summary offset section. `offset` is the position of `bytes` in the
/// file. Fails with InvalidArgument; the message names the byte.
Result<Summary> decode_summary(std::string_view bytes, std::uint64_t offset);

/// The message index records of one chunk, whose first byte is at `offset`. Completes `chunk`.
std::string encode_message_indexes(std::span<const MessageIndex> messages, std::uint64_t offset, ChunkIndex& chunk);

}  // namespace mocap::take::mcap
