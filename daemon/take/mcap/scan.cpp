#include "take/mcap/scan.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "take/mcap/crc.h"

namespace mocap::take::mcap {
namespace {

constexpr std::uint64_t kWindow_bytes = 1024 * 1024;

// Records that look like a chunk but have another checksum, until the search for the next chunk is given up: a bound on
// the time of a crafted file.
constexpr int kMaxCandidates = 1000;

// Opcode, length, three times 8 bytes, checksum and the length of the name of the compression.
constexpr std::uint64_t kChunkHead_bytes = kRecordHead_bytes + 3 * 8 + 4 + 4;

struct RecordHead {
  std::uint8_t opcode = 0;
  std::uint64_t content_bytes = 0;
};

RecordHead head_of(std::string_view bytes) {
  RecordHead head{static_cast<std::uint8_t>(bytes.front()), 0};
  std::memcpy(&head.content_bytes, bytes.data() + 1, sizeof head.content_bytes);
  return head;
}

class Scanner {
 public:
  Scanner(const InputFile& file, const ScanVisitor& visitor, const Summary* index, bool takes_loose_messages)
      : file_(file), visitor_(visitor), index_(index), takes_loose_messages_(takes_loose_messages) {
    if (index == nullptr) return;
    for (const auto& [id, schema] : index->schemas) scan_.summary.add(schema);
    for (const auto& [id, channel] : index->channels) scan_.summary.add(channel);
  }

  Result<Scan> run() {
    if (const Status begun = read_begin(); !begun) return begun.error();
    while (!scan_.has_end && at_ < file_.size()) {
      const std::uint64_t from = at_;
      if (const Status read = read_record(); !read) return read.error();
      if (at_ == from) break;  // the file ends within a record
    }
    scan_.data_bytes = at_;
    return std::move(scan_);
  }

 private:
  Status read_begin() {
    const Result<std::string> magic = file_.read(0, std::min<std::uint64_t>(kMagic.size(), file_.size()));
    if (!magic) return magic.error();
    if (*magic != kMagic) {
      return Error{ErrorCode::InvalidArgument, fmt::format("'{}', byte 0: not an MCAP file", file_.path())};
    }
    advance(*magic);
    return {};
  }

  void advance(std::string_view bytes) {
    at_ += bytes.size();
    scan_.data_crc = crc32_of(bytes, scan_.data_crc);
  }

  // Reads the record at at_ and advances; does not advance if the file ends within the record.
  Status read_record() {
    if (file_.size() - at_ < kRecordHead_bytes) return {};
    const Result<std::string> first = file_.read(at_, kRecordHead_bytes);
    if (!first) return first.error();
    const RecordHead head = head_of(*first);
    const std::uint64_t rest = file_.size() - at_ - kRecordHead_bytes;
    if (head.opcode == 0 || head.content_bytes > std::min(rest, kMaxRecord_bytes)) return find_next_chunk();
    const std::size_t damages = scan_.damages.size();
    const Result<std::string> bytes = file_.read(at_, kRecordHead_bytes + head.content_bytes);
    if (!bytes) return bytes.error();
    const RawRecord record{head.opcode, std::string_view(*bytes).substr(kRecordHead_bytes), at_};
    if (is_data_end(record)) return end(record);
    if (record.is(Opcode::Footer) || record.is(Opcode::DataEnd)) return find_next_chunk();  // its opcode is damaged
    if (const Status taken = take(record, *bytes); !taken) return taken;
    if (scan_.damages.size() > damages && !is_record_start(at_ + bytes->size())) {
      scan_.damages.resize(damages);  // its length is damaged too
      return find_next_chunk();
    }
    advance(*bytes);
    return {};
  }

  // Whether a record of a known kind may begin at `at`, or the file ends there.
  bool is_record_start(std::uint64_t at) const {
    if (at == file_.size()) return true;
    if (file_.size() - at < kRecordHead_bytes) return false;
    const Result<std::string> bytes = file_.read(at, kRecordHead_bytes);
    if (!bytes) return false;
    const RecordHead head = head_of(*bytes);
    return head.opcode > 0 && head.opcode <= static_cast<std::uint8_t>(Opcode::DataEnd) &&
           head.content_bytes <= file_.size() - at - kRecordHead_bytes;
  }

  static bool is_data_end(const RawRecord& record) {
    return record.is(Opcode::DataEnd) && record.content.size() == sizeof(DataEnd::data_crc);
  }

  Status end(const RawRecord& record) {
    scan_.has_end = true;
    scan_.announced_crc = decode<DataEnd>(record)->data_crc;
    return {};
  }

  void damaged(const RawRecord& record, const std::string& what) {
    scan_.damages.push_back({record.offset, record.length(), what});
  }

  Status visit(const RawRecord& record, std::string_view bytes, const ChunkContent* content = nullptr) const {
    return visitor_.on_record ? visitor_.on_record(record, bytes, content) : Status{};
  }

  // Adds a record to the summary, or to the damages.
  Status take(const RawRecord& record, std::string_view bytes) {
    switch (static_cast<Opcode>(record.opcode)) {
      case Opcode::Chunk: return take_chunk(record, bytes);
      case Opcode::MessageIndex: return take_message_index(record);
      case Opcode::Message: return take_message(record, bytes);
      case Opcode::Header: return take_as<Header>(record, bytes, [&](const Header& header) { scan_.header = header; });
      case Opcode::Schema: return take_known(record, bytes, scan_.summary.schemas);
      case Opcode::Channel: return take_known(record, bytes, scan_.summary.channels);
      case Opcode::Attachment:
        return take_as<Attachment>(record, bytes, [&](const Attachment& one) {
          scan_.summary.add(AttachmentIndex{record.offset, record.length(), one.log_time_ns, one.create_time_ns,
                                            one.data.size(), one.name, one.media_type});
        });
      case Opcode::Metadata:
        return take_as<Metadata>(record, bytes, [&](const Metadata& one) {
          scan_.summary.add(MetadataIndex{record.offset, record.length(), one.name});
        });
      default:
        // A later version may have added it; a damaged length would hide the chunks in it.
        if (!is_record_start(record.offset + record.length())) {
          damaged(record, fmt::format("byte {}: no valid record", record.offset));
          return {};
        }
        return is_of_summary(record) ? Status{} : visit(record, bytes);
    }
  }

  // If the DataEnd is damaged, the summary follows the data. A repair writes a new one.
  static bool is_of_summary(const RawRecord& record) {
    return record.is(Opcode::ChunkIndex) || record.is(Opcode::AttachmentIndex) || record.is(Opcode::Statistics) ||
           record.is(Opcode::MetadataIndex) || record.is(Opcode::SummaryOffset);
  }

  template <class Record, class Take>
  Status take_as(const RawRecord& record, std::string_view bytes, Take take_decoded) {
    const Result<Record> decoded = decode<Record>(record);
    if (!decoded) {
      damaged(record, decoded.error().message);
      return {};
    }
    take_decoded(*decoded);
    return visit(record, bytes);
  }

  // Whether a schema or a channel is the same wherever it occurs, and that of the index if there is one.
  template <class Record>
  bool is_consistent(const Record& one, const std::map<std::uint16_t, Record>& known) const {
    const auto found = known.find(one.id);
    return found == known.end() ? index_ == nullptr : found->second == one;
  }

  template <class Record>
  Status take_known(const RawRecord& record, std::string_view bytes, const std::map<std::uint16_t, Record>& known) {
    const Result<Record> decoded = decode<Record>(record);
    if (!decoded || !is_consistent(*decoded, known)) {
      damaged(record, fmt::format("byte {}: a schema or a channel that differs from that of its id", record.offset));
      return {};
    }
    scan_.summary.add(*decoded);
    return visit(record, bytes);
  }

  Status take_chunk(const RawRecord& record, std::string_view bytes) {
    const Result<Chunk> chunk = decode<Chunk>(record);
    const Result<ChunkContent> content = read_chunk(record);
    if (!chunk || !content) {
      damaged(record, content.error().message);
      return {};
    }
    if (const Status known = take_channels(record, *content); !known) {
      damaged(record, known.error().message);
      return {};
    }
    ChunkIndex index{chunk->start_time_ns, chunk->end_time_ns, record.offset, record.length()};
    index.compression = chunk->compression;
    index.compressed_bytes = chunk->records.size();
    index.uncompressed_bytes = chunk->uncompressed_bytes;
    scan_.summary.add(index, content->indexes());
    return visit(record, bytes, &*content);
  }

  Status take_channels(const RawRecord& record, const ChunkContent& content) {
    const bool consistent =
        std::all_of(content.schemas.begin(), content.schemas.end(),
                    [&](const Schema& schema) { return is_consistent(schema, scan_.summary.schemas); }) &&
        std::all_of(content.channels.begin(), content.channels.end(),
                    [&](const Channel& channel) { return is_consistent(channel, scan_.summary.channels); });
    if (!consistent) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("byte {}: the chunk has a schema or a channel that differs from that of its id", record.offset)};
    }
    for (const Schema& schema : content.schemas) scan_.summary.add(schema);
    for (const Channel& channel : content.channels) scan_.summary.add(channel);
    for (const MessagePlace& place : content.messages) {
      if (!scan_.summary.channels.contains(place.channel_id)) {
        return Error{
            ErrorCode::InvalidArgument,
            fmt::format("byte {}: the chunk has a message of the unknown channel {}", record.offset, place.channel_id)};
      }
    }
    return {};
  }

  Status take_message_index(const RawRecord& record) {
    const Result<MessageIndex> index = decode<MessageIndex>(record);
    constexpr std::size_t kHead_bytes = sizeof(std::uint16_t) + sizeof(std::uint32_t);
    if (!index || kHead_bytes + 16 * index->entries.size() != record.content.size()) {
      damaged(record, fmt::format("byte {}: the message index has another length than its entries", record.offset));
      return {};
    }
    if (scan_.summary.chunks.empty() || scan_.loose_messages > 0) return {};
    ChunkIndex& chunk = scan_.summary.chunks.back();
    chunk.message_index_offsets[index->channel_id] = record.offset;
    chunk.message_index_bytes += record.length();
    return {};
  }

  // A message outside of a chunk is a chunk of its own without compression: the reader needs no second case.
  Status take_message(const RawRecord& record, std::string_view bytes) {
    const Result<Message> message = decode<Message>(record);
    if (!message || !takes_loose_messages_ || !scan_.summary.channels.contains(message->channel_id)) {
      damaged(record, fmt::format("byte {}: a message outside of the chunks, or without a channel", record.offset));
      return {};
    }
    ++scan_.loose_messages;
    const ChunkIndex index{message->log_time_ns, message->log_time_ns, record.offset, record.length()};
    scan_.summary.add(index, std::vector<MessageIndex>{{message->channel_id, {{message->log_time_ns, 0}}}});
    return visit(record, bytes);
  }

  // Advances to the next whole chunk behind a damaged record. Without such a chunk the data section ends here.
  Status find_next_chunk() {
    int candidates = 0;
    for (std::uint64_t at = at_ + 1; at + kChunkHead_bytes < file_.size() && candidates < kMaxCandidates;) {
      const std::uint64_t count = std::min(kWindow_bytes + kChunkHead_bytes, file_.size() - at);
      const Result<std::string> window = file_.read(at, count);
      if (!window) return window.error();
      for (std::size_t i = 0; i + kChunkHead_bytes <= window->size() && candidates < kMaxCandidates; ++i) {
        if (!looks_like_chunk(std::string_view(*window).substr(i), at + i)) continue;
        ++candidates;
        if (is_chunk(at + i)) return skip_to(at + i);
      }
      if (window->size() <= kWindow_bytes) break;
      at += kWindow_bytes;
    }
    return {};
  }

  bool looks_like_chunk(std::string_view bytes, std::uint64_t at) const {
    if (bytes.front() != static_cast<char>(Opcode::Chunk)) return false;
    const RecordHead head = head_of(bytes);
    std::uint32_t crc = 0, name_bytes = 0;
    std::memcpy(&crc, bytes.data() + kRecordHead_bytes + 24, sizeof crc);
    std::memcpy(&name_bytes, bytes.data() + kRecordHead_bytes + 28, sizeof name_bytes);
    return head.content_bytes <= std::min(file_.size() - at - kRecordHead_bytes, kMaxRecord_bytes) && crc != 0 &&
           name_bytes <= 4;
  }

  bool is_chunk(std::uint64_t at) const {
    const Result<std::string> head = file_.read(at, kRecordHead_bytes);
    if (!head) return false;
    const Result<std::string> bytes = file_.read(at, kRecordHead_bytes + head_of(*head).content_bytes);
    return bytes && read_chunk({head_of(*head).opcode, std::string_view(*bytes).substr(kRecordHead_bytes), at});
  }

  Status skip_to(std::uint64_t next) {
    scan_.damages.push_back({at_, next - at_, fmt::format("byte {}: no valid record until byte {}", at_, next)});
    while (at_ < next) {
      const Result<std::string> bytes = file_.read(at_, std::min(kWindow_bytes, next - at_));
      if (!bytes) return bytes.error();
      advance(*bytes);
    }
    return {};
  }

  const InputFile& file_;
  const ScanVisitor& visitor_;
  const Summary* index_;
  bool takes_loose_messages_;
  Scan scan_;
  std::uint64_t at_ = 0;
};

}  // namespace

Result<Scan> scan(const InputFile& file, const ScanVisitor& visitor, const Summary* index) {
  static const ScanVisitor kNoVisitor;
  // Only the whole file tells whether it has chunks, so a visitor needs a first pass.
  Result<Scan> first = Scanner(file, kNoVisitor, index, true).run();
  if (!first) return first;
  const bool has_chunks = first->summary.chunks.size() > first->loose_messages;
  const bool again = visitor.on_record || (has_chunks && first->loose_messages > 0);
  return again ? Scanner(file, visitor, index, !has_chunks).run() : std::move(first);
}

}  // namespace mocap::take::mcap
