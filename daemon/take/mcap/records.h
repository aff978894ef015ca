#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mocap::take::mcap {

// The records of an MCAP file. A record is its opcode (1 byte), the length of its content (8 bytes), and its content.
// Numbers are little-endian. Times are ns since an epoch that the writer chooses; a take uses the Unix epoch.
//
// Source: the MCAP file format specification, version 0, https://mcap.dev/spec.

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHead_bytes = 9;                           ///< opcode and length
inline constexpr std::size_t kFooter_bytes = kRecordHead_bytes + 20;          ///< the record of a Footer
inline constexpr std::size_t kDataEnd_bytes = kRecordHead_bytes + 4;          ///< the record of a DataEnd
inline constexpr std::size_t kFileEnd_bytes = kFooter_bytes + kMagic.size();  ///< what every complete file ends with

enum class Opcode : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Attachment = 0x09,
  AttachmentIndex = 0x0A,
  Statistics = 0x0B,
  Metadata = 0x0C,
  MetadataIndex = 0x0D,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F,
};

/// Texts by name. A map, so that equal texts give equal bytes.
using Texts = std::map<std::string, std::string>;

struct Header {
  std::string profile;
  std::string library;  ///< program and version of the writer
};

struct Footer {
  std::uint64_t summary_start = 0;         ///< byte of the file; 0: no summary
  std::uint64_t summary_offset_start = 0;  ///< byte of the file; 0: no summary offsets
  std::uint32_t summary_crc = 0;           ///< 0: unknown
};

struct Schema {
  std::uint16_t id = 0;  ///< from 1
  std::string name;
  std::string encoding;
  std::string data;

  bool operator==(const Schema&) const = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: no schema
  std::string topic;
  std::string message_encoding;
  Texts metadata;

  bool operator==(const Channel&) const = default;
};

/// The data are valid as long as the bytes from which the message was decoded.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string_view data;
};

/// The records are valid as long as the bytes from which the chunk was decoded.
struct Chunk {
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: unknown
  std::string compression;
  std::string_view records;  ///< compressed
};

struct MessageIndex {
  std::uint16_t channel_id = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> entries;  ///< log time, byte in the uncompressed records
};

struct ChunkIndex {
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::uint64_t offset = 0;                                        ///< of the chunk's record
  std::uint64_t length = 0;                                        ///< of the chunk's record
  std::map<std::uint16_t, std::uint64_t> message_index_offsets{};  ///< by channel
  std::uint64_t message_index_bytes = 0;
  std::string compression{};
  std::uint64_t compressed_bytes = 0;
  std::uint64_t uncompressed_bytes = 0;
};

struct Attachment {
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;  ///< 0: unknown
  std::string name;
  std::string media_type;
  std::string_view data;
  std::uint32_t crc = 0;  ///< 0: unknown
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::uint64_t data_bytes = 0;
  std::string name;
  std::string media_type;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start_time_ns = 0;  ///< 0: no messages
  std::uint64_t end_time_ns = 0;
  std::map<std::uint16_t, std::uint64_t> channel_messages{};  ///< by channel
};

struct Metadata {
  std::string name;
  Texts texts;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

struct SummaryOffset {
  Opcode group = Opcode::Schema;
  std::uint64_t start = 0;
  std::uint64_t length = 0;
};

struct DataEnd {
  std::uint32_t data_crc = 0;  ///< of all bytes before this record; 0: unknown
};

}  // namespace mocap::take::mcap
