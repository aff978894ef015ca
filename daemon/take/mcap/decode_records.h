#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "take/mcap/records.h"

namespace mocap::take::mcap {

/// A record whose content is not decoded. The content is valid as long as the bytes from which it was read.
struct RawRecord {
  std::uint8_t opcode = 0;
  std::string_view content;
  std::uint64_t offset = 0;  ///< of the record's first byte, where the caller counts from

  std::uint64_t length() const noexcept { return kRecordHead_bytes + content.size(); }
  bool is(Opcode which) const noexcept { return opcode == static_cast<std::uint8_t>(which); }
};

/// The first record of `bytes`; nothing if `bytes` end within the record. `offset` is the position of `bytes`.
std::optional<RawRecord> first_record(std::string_view bytes, std::uint64_t offset);

/// Decodes the content of a record of the type `Record`. Bytes after the last known field are ignored, as the
/// specification asks. Fails with InvalidArgument if a field ends behind the record; the message names the byte.
template <class Record>
Result<Record> decode(const RawRecord& record);

template <>
Result<Header> decode(const RawRecord& record);
template <>
Result<Footer> decode(const RawRecord& record);
template <>
Result<Schema> decode(const RawRecord& record);
template <>
Result<Channel> decode(const RawRecord& record);
template <>
Result<Message> decode(const RawRecord& record);
template <>
Result<Chunk> decode(const RawRecord& record);
template <>
Result<MessageIndex> decode(const RawRecord& record);
template <>
Result<ChunkIndex> decode(const RawRecord& record);
/// Also fails if the checksum differs.
template <>
Result<Attachment> decode(const RawRecord& record);
template <>
Result<AttachmentIndex> decode(const RawRecord& record);
template <>
Result<Statistics> decode(const RawRecord& record);
template <>
Result<Metadata> decode(const RawRecord& record);
template <>
Result<MetadataIndex> decode(const RawRecord& record);
template <>
Result<SummaryOffset> decode(const RawRecord& record);
template <>
Result<DataEnd> decode(const RawRecord& record);

}  // namespace mocap::take::mcap
