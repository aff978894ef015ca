#include "take/mcap/decode_records.h"

#include <fmt/core.h>

#include <concepts>
#include <cstring>

#include "take/mcap/crc.h"

namespace mocap::take::mcap {
namespace {

// Reads the fields of one record. After the first field that ends behind the record, every field is empty and `status`
// has the error.
class Fields {
 public:
  Fields(const RawRecord& record, const char* what)
      : rest_(record.content), at_(record.offset + kRecordHead_bytes), what_(what) {}

  std::string_view bytes(std::uint64_t count) {
    if (failed_ || count > rest_.size()) {
      if (!failed_) failed_at_ = at_;
      failed_ = true;
      return {};
    }
    const std::string_view read = rest_.substr(0, count);
    rest_.remove_prefix(count);
    at_ += count;
    return read;
  }

  template <class Number>
  Number number() {
    const std::string_view from = bytes(sizeof(Number));
    Number value{};
    if (from.size() == sizeof(Number)) std::memcpy(&value, from.data(), sizeof(Number));
    return value;
  }

  std::string text() { return std::string(bytes(number<std::uint32_t>())); }

  // Calls `entry` with the fields of a list until the list ends.
  template <class Entry>
  void list(Entry entry) {
    Fields within = *this;
    within.at_ = at_ + sizeof(std::uint32_t);
    within.rest_ = bytes(number<std::uint32_t>());
    while (!failed_ && !within.rest_.empty()) {
      entry(within);
      if (within.failed_) {
        failed_ = true;
        failed_at_ = within.failed_at_;
      }
    }
  }

  Texts texts() {
    Texts all;
    list([&](Fields& entry) {
      std::string key = entry.text();
      std::string value = entry.text();
      if (!entry.failed_) all.insert_or_assign(std::move(key), std::move(value));
    });
    return all;
  }

  std::map<std::uint16_t, std::uint64_t> numbers() {
    std::map<std::uint16_t, std::uint64_t> all;
    list([&](Fields& entry) {
      const auto key = entry.number<std::uint16_t>();
      all[key] = entry.number<std::uint64_t>();
    });
    return all;
  }

  std::string_view rest() { return bytes(rest_.size()); }

  template <class Record>
  Result<Record> finish(Record record) const {
    if (failed_) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("byte {}: a field of the {} ends behind its record", failed_at_, what_)};
    }
    return record;
  }

 private:
  std::string_view rest_;
  std::uint64_t at_;
  const char* what_;
  bool failed_ = false;
  std::uint64_t failed_at_ = 0;
};

}  // namespace

std::optional<RawRecord> first_record(std::string_view bytes, std::uint64_t offset) {
  if (bytes.size() < kRecordHead_bytes) return std::nullopt;
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data() + 1, sizeof length);
  if (length > bytes.size() - kRecordHead_bytes) return std::nullopt;
  return RawRecord{static_cast<std::uint8_t>(bytes.front()), bytes.substr(kRecordHead_bytes, length), offset};
}

template <>
Result<Header> decode(const RawRecord& record) {
  Fields fields(record, "header");
  Header into;
  into.profile = fields.text();
  into.library = fields.text();
  return fields.finish(std::move(into));
}

template <>
Result<Footer> decode(const RawRecord& record) {
  Fields fields(record, "footer");
  Footer into;
  into.summary_start = fields.number<std::uint64_t>();
  into.summary_offset_start = fields.number<std::uint64_t>();
  into.summary_crc = fields.number<std::uint32_t>();
  return fields.finish(into);
}

template <>
Result<Schema> decode(const RawRecord& record) {
  Fields fields(record, "schema");
  Schema into;
  into.id = fields.number<std::uint16_t>();
  into.name = fields.text();
  into.encoding = fields.text();
  into.data = fields.text();
  return fields.finish(std::move(into));
}

template <>
Result<Channel> decode(const RawRecord& record) {
  Fields fields(record, "channel");
  Channel into;
  into.id = fields.number<std::uint16_t>();
  into.schema_id = fields.number<std::uint16_t>();
  into.topic = fields.text();
  into.message_encoding = fields.text();
  into.metadata = fields.texts();
  return fields.finish(std::move(into));
}

template <>
Result<Message> decode(const RawRecord& record) {
  Fields fields(record, "message");
  Message into;
  into.channel_id = fields.number<std::uint16_t>();
  into.sequence = fields.number<std::uint32_t>();
  into.log_time_ns = fields.number<std::uint64_t>();
  into.publish_time_ns = fields.number<std::uint64_t>();
  into.data = fields.rest();
  return fields.finish(into);
}

template <>
Result<Chunk> decode(const RawRecord& record) {
  Fields fields(record, "chunk");
  Chunk into;
  into.start_time_ns = fields.number<std::uint64_t>();
  into.end_time_ns = fields.number<std::uint64_t>();
  into.uncompressed_bytes = fields.number<std::uint64_t>();
  into.uncompressed_crc = fields.number<std::uint32_t>();
  into.compression = fields.text();
  into.records = fields.bytes(fields.number<std::uint64_t>());
  return fields.finish(std::move(into));
}

template <>
Result<MessageIndex> decode(const RawRecord& record) {
  Fields fields(record, "message index");
  MessageIndex into;
  into.channel_id = fields.number<std::uint16_t>();
  fields.list([&](Fields& entry) {
    const auto time_ns = entry.number<std::uint64_t>();
    into.entries.emplace_back(time_ns, entry.number<std::uint64_t>());
  });
  return fields.finish(std::move(into));
}

template <>
Result<ChunkIndex> decode(const RawRecord& record) {
  Fields fields(record, "chunk index");
  ChunkIndex into;
  into.start_time_ns = fields.number<std::uint64_t>();
  into.end_time_ns = fields.number<std::uint64_t>();
  into.offset = fields.number<std::uint64_t>();
  into.length = fields.number<std::uint64_t>();
  into.message_index_offsets = fields.numbers();
  into.message_index_bytes = fields.number<std::uint64_t>();
  into.compression = fields.text();
  into.compressed_bytes = fields.number<std::uint64_t>();
  into.uncompressed_bytes = fields.number<std::uint64_t>();
  return fields.finish(std::move(into));
}

template <>
Result<Attachment> decode(const RawRecord& record) {
  Fields fields(record, "attachment");
  Attachment into;
  into.log_time_ns = fields.number<std::uint64_t>();
  into.create_time_ns = fields.number<std::uint64_t>();
  into.name = fields.text();
  into.media_type = fields.text();
  into.data = fields.bytes(fields.number<std::uint64_t>());
  const std::size_t checked = 8 + 8 + 4 + into.name.size() + 4 + into.media_type.size() + 8 + into.data.size();
  into.crc = fields.number<std::uint32_t>();
  Result<Attachment> read = fields.finish(std::move(into));
  if (read && read->crc != 0 && read->crc != crc32_of(record.content.substr(0, checked))) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("byte {}: the attachment '{}' does not have its checksum", record.offset, read->name)};
  }
  return read;
}

template <>
Result<AttachmentIndex> decode(const RawRecord& record) {
  Fields fields(record, "attachment index");
  AttachmentIndex into;
  into.offset = fields.number<std::uint64_t>();
  into.length = fields.number<std::uint64_t>();
  into.log_time_ns = fields.number<std::uint64_t>();
  into.create_time_ns = fields.number<std::uint64_t>();
  into.data_bytes = fields.number<std::uint64_t>();
  into.name = fields.text();
  into.media_type = fields.text();
  return fields.finish(std::move(into));
}

template <>
Result<Statistics> decode(const RawRecord& record) {
  Fields fields(record, "statistics");
  Statistics into;
  into.messages = fields.number<std::uint64_t>();
  into.schemas = fields.number<std::uint16_t>();
  into.channels = fields.number<std::uint32_t>();
  into.attachments = fields.number<std::uint32_t>();
  into.metadata = fields.number<std::uint32_t>();
  into.chunks = fields.number<std::uint32_t>();
  into.start_time_ns = fields.number<std::uint64_t>();
  into.end_time_ns = fields.number<std::uint64_t>();
  into.channel_messages = fields.numbers();
  return fields.finish(std::move(into));
}

template <>
Result<Metadata> decode(const RawRecord& record) {
  Fields fields(record, "metadata");
  Metadata into;
  into.name = fields.text();
  into.texts = fields.texts();
  return fields.finish(std::move(into));
}

template <>
Result<MetadataIndex> decode(const RawRecord& record) {
  Fields fields(record, "metadata index");
  MetadataIndex into;
  into.offset = fields.number<std::uint64_t>();
  into.length = fields.number<std::uint64_t>();
  into.name = fields.text();
  return fields.finish(std::move(into));
}

template <>
Result<SummaryOffset> decode(const RawRecord& record) {
  Fields fields(record, "summary offset");
  SummaryOffset into;
  into.group = static_cast<Opcode>(fields.number<std::uint8_t>());
  into.start = fields.number<std::uint64_t>();
  into.length = fields.number<std::uint64_t>();
  return fields.finish(into);
}

template <>
Result<DataEnd> decode(const RawRecord& record) {
  Fields fields(record, "data end");
  DataEnd into;
  into.data_crc = fields.number<std::uint32_t>();
  return fields.finish(into);
}

}  // namespace mocap::take::mcap
