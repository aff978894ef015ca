#include "take/mcap/chunk_content.h"

#include <fmt/core.h>

#include <map>

#include "base/expects.h"
#include "take/mcap/compression.h"
#include "take/mcap/crc.h"

namespace mocap::take::mcap {
namespace {

Error damaged(std::uint64_t offset, const std::string& why, ErrorCode code = ErrorCode::InvalidArgument) {
  return {code, fmt::format("byte {}: the chunk is damaged: {}", offset, why)};
}

Status take_record(const RawRecord& raw, ChunkContent& into) {
  if (raw.is(Opcode::Message)) {
    const Result<Message> message = decode<Message>(raw);
    if (!message) return message.error();
    into.messages.push_back({message->log_time_ns, raw.offset, message->channel_id});
  } else if (raw.is(Opcode::Schema)) {
    Result<Schema> schema = decode<Schema>(raw);
    if (!schema) return schema.error();
    into.schemas.push_back(*std::move(schema));
  } else if (raw.is(Opcode::Channel)) {
    Result<Channel> channel = decode<Channel>(raw);
    if (!channel) return channel.error();
    into.channels.push_back(*std::move(channel));
  }
  return {};
}

}  // namespace

Message ChunkContent::message(const MessagePlace& place) const {
  const auto raw = first_record(std::string_view(records).substr(place.offset), place.offset);
  MOCAP_EXPECTS(raw && raw->is(Opcode::Message));
  return *decode<Message>(*raw);
}

std::vector<MessageIndex> ChunkContent::indexes() const {
  std::map<std::uint16_t, MessageIndex> by_channel;
  for (const MessagePlace& place : messages) {
    MessageIndex& index = by_channel[place.channel_id];
    index.channel_id = place.channel_id;
    index.entries.emplace_back(place.log_time_ns, place.offset);
  }
  std::vector<MessageIndex> all;
  for (auto& [id, index] : by_channel) all.push_back(std::move(index));
  return all;
}

Result<ChunkContent> read_chunk(const RawRecord& record) {
  const Result<Chunk> chunk = decode<Chunk>(record);
  if (!chunk) return chunk.error();
  if (chunk->uncompressed_bytes > kMaxRecord_bytes) {
    return damaged(record.offset, fmt::format("it announces {} bytes of records, expected at most {}",
                                              chunk->uncompressed_bytes, kMaxRecord_bytes));
  }
  Result<std::string> records = uncompress(chunk->compression, chunk->records, chunk->uncompressed_bytes);
  if (!records) return damaged(record.offset, records.error().message, records.error().code);
  if (chunk->uncompressed_crc != 0 && chunk->uncompressed_crc != crc32_of(*records)) {
    return damaged(record.offset, "its records do not have their checksum");
  }
  Result<ChunkContent> content = read_records(*std::move(records), record.offset);
  if (!content) return content;
  for (const MessagePlace& place : content->messages) {
    if (place.log_time_ns < chunk->start_time_ns || place.log_time_ns > chunk->end_time_ns) {
      return damaged(record.offset, "a message is outside of the time that the chunk announces");
    }
  }
  return content;
}

Result<ChunkContent> read_records(std::string records, std::uint64_t offset) {
  ChunkContent content;
  content.records = std::move(records);
  std::uint64_t at = 0;
  while (at < content.records.size()) {
    const auto raw = first_record(std::string_view(content.records).substr(at), at);
    if (!raw) return damaged(offset, fmt::format("the record at its byte {} ends behind it", at));
    if (const Status taken = take_record(*raw, content); !taken) return damaged(offset, taken.error().message);
    at += raw->length();
  }
  return content;
}

}  // namespace mocap::take::mcap
