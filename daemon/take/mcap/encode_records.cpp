#include "take/mcap/encode_records.h"

#include <bit>
#include <cstring>

#include "take/mcap/crc.h"

namespace mocap::take::mcap {
namespace {

static_assert(std::endian::native == std::endian::little, "MCAP numbers are little-endian");

template <class Number>
void put(Number number, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void put(std::string_view text, std::string& bytes) {
  put(static_cast<std::uint32_t>(text.size()), bytes);
  bytes += text;
}

// Writes a length of type `Length` before what `content` appends.
template <class Length, class Content>
void put_sized(std::string& bytes, Content content) {
  const std::size_t at = bytes.size();
  bytes.append(sizeof(Length), '\0');
  content();
  const auto length = static_cast<Length>(bytes.size() - at - sizeof(Length));
  std::memcpy(bytes.data() + at, &length, sizeof length);
}

template <class Content>
void put_record(Opcode opcode, std::string& bytes, Content content) {
  bytes.push_back(static_cast<char>(opcode));
  put_sized<std::uint64_t>(bytes, content);
}

void put(const Texts& texts, std::string& bytes) {
  put_sized<std::uint32_t>(bytes, [&] {
    for (const auto& [key, value] : texts) {
      put(std::string_view(key), bytes);
      put(std::string_view(value), bytes);
    }
  });
}

void put(const std::map<std::uint16_t, std::uint64_t>& numbers, std::string& bytes) {
  put_sized<std::uint32_t>(bytes, [&] {
    for (const auto& [key, value] : numbers) {
      put(key, bytes);
      put(value, bytes);
    }
  });
}

}  // namespace

void encode(const Header& from, std::string& bytes) {
  put_record(Opcode::Header, bytes, [&] {
    put(std::string_view(from.profile), bytes);
    put(std::string_view(from.library), bytes);
  });
}

void encode(const Footer& from, std::string& bytes) {
  put_record(Opcode::Footer, bytes, [&] {
    put(from.summary_start, bytes);
    put(from.summary_offset_start, bytes);
    put(from.summary_crc, bytes);
  });
}

void encode(const Schema& from, std::string& bytes) {
  put_record(Opcode::Schema, bytes, [&] {
    put(from.id, bytes);
    put(std::string_view(from.name), bytes);
    put(std::string_view(from.encoding), bytes);
    put(std::string_view(from.data), bytes);
  });
}

void encode(const Channel& from, std::string& bytes) {
  put_record(Opcode::Channel, bytes, [&] {
    put(from.id, bytes);
    put(from.schema_id, bytes);
    put(std::string_view(from.topic), bytes);
    put(std::string_view(from.message_encoding), bytes);
    put(from.metadata, bytes);
  });
}

void encode(const Message& from, std::string& bytes) {
  put_record(Opcode::Message, bytes, [&] {
    put(from.channel_id, bytes);
    put(from.sequence, bytes);
    put(from.log_time_ns, bytes);
    put(from.publish_time_ns, bytes);
    bytes += from.data;
  });
}

void encode(const Chunk& from, std::string& bytes) {
  put_record(Opcode::Chunk, bytes, [&] {
    put(from.start_time_ns, bytes);
    put(from.end_time_ns, bytes);
    put(from.uncompressed_bytes, bytes);
    put(from.uncompressed_crc, bytes);
    put(std::string_view(from.compression), bytes);
    put(static_cast<std::uint64_t>(from.records.size()), bytes);
    bytes += from.records;
  });
}

void encode(const MessageIndex& from, std::string& bytes) {
  put_record(Opcode::MessageIndex, bytes, [&] {
    put(from.channel_id, bytes);
    put_sized<std::uint32_t>(bytes, [&] {
      for (const auto& [time_ns, offset] : from.entries) {
        put(time_ns, bytes);
        put(offset, bytes);
      }
    });
  });
}

void encode(const ChunkIndex& from, std::string& bytes) {
  put_record(Opcode::ChunkIndex, bytes, [&] {
    put(from.start_time_ns, bytes);
    put(from.end_time_ns, bytes);
    put(from.offset, bytes);
    put(from.length, bytes);
    put(from.message_index_offsets, bytes);
    put(from.message_index_bytes, bytes);
    put(std::string_view(from.compression), bytes);
    put(from.compressed_bytes, bytes);
    put(from.uncompressed_bytes, bytes);
  });
}

void encode(const Attachment& from, std::string& bytes) {
  put_record(Opcode::Attachment, bytes, [&] {
    const std::size_t begin = bytes.size();
    put(from.log_time_ns, bytes);
    put(from.create_time_ns, bytes);
    put(std::string_view(from.name), bytes);
    put(std::string_view(from.media_type), bytes);
    put(static_cast<std::uint64_t>(from.data.size()), bytes);
    bytes += from.data;
    put(crc32_of(std::string_view(bytes).substr(begin)), bytes);
  });
}

void encode(const AttachmentIndex& from, std::string& bytes) {
  put_record(Opcode::AttachmentIndex, bytes, [&] {
    put(from.offset, bytes);
    put(from.length, bytes);
    put(from.log_time_ns, bytes);
    put(from.create_time_ns, bytes);
    put(from.data_bytes, bytes);
    put(std::string_view(from.name), bytes);
    put(std::string_view(from.media_type), bytes);
  });
}

void encode(const Statistics& from, std::string& bytes) {
  put_record(Opcode::Statistics, bytes, [&] {
    put(from.messages, bytes);
    put(from.schemas, bytes);
    put(from.channels, bytes);
    put(from.attachments, bytes);
    put(from.metadata, bytes);
    put(from.chunks, bytes);
    put(from.start_time_ns, bytes);
    put(from.end_time_ns, bytes);
    put(from.channel_messages, bytes);
  });
}

void encode(const Metadata& from, std::string& bytes) {
  put_record(Opcode::Metadata, bytes, [&] {
    put(std::string_view(from.name), bytes);
    put(from.texts, bytes);
  });
}

void encode(const MetadataIndex& from, std::string& bytes) {
  put_record(Opcode::MetadataIndex, bytes, [&] {
    put(from.offset, bytes);
    put(from.length, bytes);
    put(std::string_view(from.name), bytes);
  });
}

void encode(const SummaryOffset& from, std::string& bytes) {
  put_record(Opcode::SummaryOffset, bytes, [&] {
    put(static_cast<std::uint8_t>(from.group), bytes);
    put(from.start, bytes);
    put(from.length, bytes);
  });
}

void encode(const DataEnd& from, std::string& bytes) {
  put_record(Opcode::DataEnd, bytes, [&] { put(from.data_crc, bytes); });
}

}  // namespace mocap::take::mcap
