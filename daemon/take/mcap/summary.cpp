#include "take/mcap/summary.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>

#include "take/mcap/crc.h"
#include "take/mcap/decode_records.h"
#include "take/mcap/encode_records.h"

namespace mocap::take::mcap {
namespace {

// Appends the records of one kind, and their summary offset if there are any.
void encode_group(Opcode kind, std::uint64_t base, std::string& bytes, std::vector<SummaryOffset>& offsets,
                  const std::function<void()>& records) {
  const std::size_t begin = bytes.size();
  records();
  if (bytes.size() > begin) offsets.push_back({kind, base + begin, bytes.size() - begin});
}

template <class Record, class Take>
Status decode_into(const RawRecord& raw, Take take) {
  Result<Record> record = decode<Record>(raw);
  if (!record) return record.error();
  take(*std::move(record));
  return {};
}

Status decode_one(const RawRecord& raw, Summary& into) {
  switch (static_cast<Opcode>(raw.opcode)) {
    case Opcode::Schema:
      return decode_into<Schema>(raw, [&](Schema schema) { into.schemas[schema.id] = std::move(schema); });
    case Opcode::Channel:
      return decode_into<Channel>(raw, [&](Channel channel) { into.channels[channel.id] = std::move(channel); });
    case Opcode::ChunkIndex:
      return decode_into<ChunkIndex>(raw, [&](ChunkIndex chunk) { into.chunks.push_back(std::move(chunk)); });
    case Opcode::AttachmentIndex:
      return decode_into<AttachmentIndex>(raw,
                                          [&](AttachmentIndex one) { into.attachments.push_back(std::move(one)); });
    case Opcode::MetadataIndex:
      return decode_into<MetadataIndex>(raw, [&](MetadataIndex one) { into.metadata.push_back(std::move(one)); });
    case Opcode::Statistics:
      return decode_into<Statistics>(raw, [&](Statistics statistics) { into.statistics = std::move(statistics); });
    default: return {};  // summary offsets, and records that a later version added
  }
}

}  // namespace

void Summary::add(const Schema& schema) {
  schemas[schema.id] = schema;
  statistics.schemas = static_cast<std::uint16_t>(schemas.size());
}

void Summary::add(const Channel& channel) {
  channels[channel.id] = channel;
  statistics.channels = static_cast<std::uint32_t>(channels.size());
}

void Summary::add(const ChunkIndex& chunk, std::span<const MessageIndex> messages) {
  chunks.push_back(chunk);
  ++statistics.chunks;
  for (const MessageIndex& one : messages) {
    if (one.entries.empty()) continue;
    const bool first = statistics.messages == 0;
    statistics.start_time_ns = first ? chunk.start_time_ns : std::min(statistics.start_time_ns, chunk.start_time_ns);
    statistics.end_time_ns = std::max(statistics.end_time_ns, chunk.end_time_ns);
    statistics.messages += one.entries.size();
    statistics.channel_messages[one.channel_id] += one.entries.size();
  }
}

void Summary::add(const AttachmentIndex& attachment) {
  attachments.push_back(attachment);
  ++statistics.attachments;
}

void Summary::add(const MetadataIndex& one) {
  metadata.push_back(one);
  ++statistics.metadata;
}

std::string encode_file_end(const Summary& summary, std::uint64_t data_bytes, std::uint32_t data_crc) {
  std::string bytes;
  encode(DataEnd{data_crc}, bytes);
  const std::uint64_t start = data_bytes + bytes.size();
  std::vector<SummaryOffset> offsets;
  const auto group = [&](Opcode kind, const std::function<void()>& records) {
    encode_group(kind, data_bytes, bytes, offsets, records);
  };
  group(Opcode::Schema, [&] {
    for (const auto& [id, schema] : summary.schemas) encode(schema, bytes);
  });
  group(Opcode::Channel, [&] {
    for (const auto& [id, channel] : summary.channels) encode(channel, bytes);
  });
  group(Opcode::ChunkIndex, [&] {
    for (const ChunkIndex& chunk : summary.chunks) encode(chunk, bytes);
  });
  group(Opcode::AttachmentIndex, [&] {
    for (const AttachmentIndex& attachment : summary.attachments) encode(attachment, bytes);
  });
  group(Opcode::MetadataIndex, [&] {
    for (const MetadataIndex& metadata : summary.metadata) encode(metadata, bytes);
  });
  group(Opcode::Statistics, [&] { encode(summary.statistics, bytes); });
  const std::uint64_t offset_start = data_bytes + bytes.size();
  for (const SummaryOffset& offset : offsets) encode(offset, bytes);
  std::string footer;
  encode(Footer{start, offset_start, 0}, footer);
  // The checksum covers the footer up to the checksum itself.
  const std::string_view summed = std::string_view(bytes).substr(start - data_bytes);
  const std::string_view footer_head = std::string_view(footer).substr(0, footer.size() - sizeof(std::uint32_t));
  encode(Footer{start, offset_start, crc32_of(footer_head, crc32_of(summed))}, bytes);
  bytes += kMagic;
  return bytes;
}

Result<Summary> decode_summary(std::string_view bytes, std::uint64_t offset) {
  Summary summary;
  while (!bytes.empty()) {
    const auto raw = first_record(bytes, offset);
    if (!raw) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("byte {}: a record of the summary ends behind the summary", offset)};
    }
    if (const Status decoded = decode_one(*raw, summary); !decoded) return decoded.error();
    bytes.remove_prefix(raw->length());
    offset += raw->length();
  }
  return summary;
}

std::string encode_message_indexes(std::span<const MessageIndex> messages, std::uint64_t offset, ChunkIndex& chunk) {
  std::string bytes;
  chunk.message_index_offsets.clear();
  for (const MessageIndex& one : messages) {
    if (one.entries.empty()) continue;
    chunk.message_index_offsets[one.channel_id] = offset + bytes.size();
    encode(one, bytes);
  }
  chunk.message_index_bytes = bytes.size();
  return bytes;
}

}  // namespace mocap::take::mcap
