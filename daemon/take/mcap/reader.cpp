#include "take/mcap/reader.h"

#include <fmt/core.h>

#include <algorithm>

#include "take/mcap/crc.h"

namespace mocap::take::mcap {

Result<Reader> Reader::open(const std::filesystem::path& path) {
  Result<InputFile> file = InputFile::open(path);
  if (!file) return file.error();
  Reader reader(*std::move(file));
  const Status indexed = reader.read_index();
  if (indexed) return reader;
  Result<Scan> scanned = scan(reader.file_);
  if (!scanned) return scanned.error();
  reader.header_ = std::move(scanned->header);
  reader.summary_ = std::move(scanned->summary);
  reader.damages_ = std::move(scanned->damages);
  reader.cut_off_ = !scanned->has_end;
  if (scanned->has_end && indexed.error().code == ErrorCode::InvalidArgument) {
    reader.damages_.push_back({scanned->data_bytes, 0, indexed.error().message});
  }
  return reader;
}

// Fails with EndOfStream if the file ends without a footer or has no index, and with InvalidArgument if the index is
// damaged.
Status Reader::read_index() {
  const Error none{ErrorCode::EndOfStream, "no index"};
  if (file_.size() < kMagic.size() + kFileEnd_bytes) return none;
  const Result<std::string> head = file_.read(0, std::min<std::uint64_t>(file_.size(), 64 * 1024));
  const std::uint64_t end = file_.size() - kFileEnd_bytes;
  const Result<std::string> tail = file_.read(end, kFileEnd_bytes);
  if (!head || !tail || !head->starts_with(kMagic) || !tail->ends_with(kMagic)) return none;
  const auto header_record = first_record(std::string_view(*head).substr(kMagic.size()), kMagic.size());
  if (!header_record || !header_record->is(Opcode::Header)) return none;
  Result<Header> header = decode<Header>(*header_record);
  const auto footer_record = first_record(*tail, end);
  if (!footer_record || !footer_record->is(Opcode::Footer) || !header) return none;
  const Result<Footer> footer = decode<Footer>(*footer_record);
  if (!footer || footer->summary_start == 0) return none;
  if (footer->summary_start > end) {
    return Error{ErrorCode::InvalidArgument, fmt::format("byte {}: the footer says that the summary begins at byte {}",
                                                         end, footer->summary_start)};
  }
  const Result<std::string> bytes = file_.read(footer->summary_start, end - footer->summary_start);
  if (!bytes) return bytes.error();
  const std::string_view footer_head = std::string_view(*tail).substr(0, kFooter_bytes - sizeof(std::uint32_t));
  if (footer->summary_crc != 0 && footer->summary_crc != crc32_of(footer_head, crc32_of(*bytes))) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("byte {}: the summary does not have its checksum", footer->summary_start)};
  }
  Result<Summary> summary = decode_summary(*bytes, footer->summary_start);
  if (!summary) return summary.error();
  if (summary->chunks.empty() && summary->statistics.messages > 0) return none;  // messages outside of chunks
  for (const MetadataIndex& metadata : summary->metadata) {
    // Not so if add_metadata was interrupted.
    if (const auto found = record_bytes(metadata.offset, metadata.length, Opcode::Metadata); !found)
      return found.error();
  }
  header_ = *std::move(header);
  summary_ = *std::move(summary);
  return {};
}

Result<std::string> Reader::record_bytes(std::uint64_t offset, std::uint64_t length, Opcode opcode) const {
  if (length > kMaxRecord_bytes + kRecordHead_bytes) {
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}', byte {}: a record of {} bytes, expected at most {}",
                                                         path(), offset, length, kMaxRecord_bytes)};
  }
  Result<std::string> bytes = file_.read(offset, length);
  if (!bytes) return bytes;
  const auto record = first_record(*bytes, offset);
  if (!record || record->length() != length || !record->is(opcode)) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}', byte {}: expected a record of {} bytes with opcode {}, which the index names",
                             path(), offset, length, static_cast<int>(opcode))};
  }
  return bytes;
}

Result<Metadata> Reader::metadata(const MetadataIndex& index) const {
  const Result<std::string> bytes = record_bytes(index.offset, index.length, Opcode::Metadata);
  if (!bytes) return bytes.error();
  return decode<Metadata>(*first_record(*bytes, index.offset));
}

Result<std::string> Reader::attachment(const AttachmentIndex& index) const {
  const Result<std::string> bytes = record_bytes(index.offset, index.length, Opcode::Attachment);
  if (!bytes) return bytes.error();
  const Result<Attachment> decoded = decode<Attachment>(*first_record(*bytes, index.offset));
  if (!decoded) return Error{decoded.error().code, fmt::format("'{}', {}", path(), decoded.error().message)};
  return std::string(decoded->data);
}

Result<ChunkContent> Reader::chunk(const ChunkIndex& index) const {
  const Result<std::string> first = file_.read(index.offset, 1);
  if (!first) return first.error();
  const bool lone = first->front() == static_cast<char>(Opcode::Message);  // outside of a chunk, see scan.cpp
  Result<std::string> bytes = record_bytes(index.offset, index.length, lone ? Opcode::Message : Opcode::Chunk);
  if (!bytes) return bytes.error();
  Result<ChunkContent> content =
      lone ? read_records(*std::move(bytes), index.offset) : read_chunk(*first_record(*bytes, index.offset));
  if (!content) return Error{content.error().code, fmt::format("'{}', {}", path(), content.error().message)};
  for (const MessagePlace& place : content->messages) {
    if (summary_.channels.contains(place.channel_id)) continue;
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}', byte {}: a message of the unknown channel {}", path(),
                                                         index.offset, place.channel_id)};
  }
  return content;
}

MessageCursor::MessageCursor(const Reader& reader, std::set<std::uint16_t> channels, std::uint64_t from_ns)
    : reader_(reader), channels_(std::move(channels)), from_ns_(from_ns) {
  for (const ChunkIndex& chunk : reader.summary().chunks) {
    if (is_selected(chunk)) chunks_.push_back(&chunk);
  }
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const ChunkIndex* a, const ChunkIndex* b) { return a->start_time_ns < b->start_time_ns; });
}

bool MessageCursor::is_selected(const ChunkIndex& chunk) const {
  if (chunk.end_time_ns < from_ns_) return false;
  if (channels_.empty() || chunk.message_index_offsets.empty()) return true;
  return std::any_of(channels_.begin(), channels_.end(),
                     [&](std::uint16_t channel) { return chunk.message_index_offsets.contains(channel); });
}

Result<std::optional<Message>> MessageCursor::next() {
  // A chunk is closed only here: the last message was valid until now.
  std::erase_if(open_, [&](const auto& chunk) {
    if (chunk->next < chunk->messages.size()) return false;
    open_bytes_ -= chunk->content.records.size();
    return true;
  });
  for (OpenChunk* chunk = earliest();; chunk = earliest()) {
    const auto time = chunk == nullptr ? std::nullopt : std::optional(chunk->messages[chunk->next].log_time_ns);
    const std::size_t before = next_chunk_;
    if (const Status opened = open_until(time); !opened) return opened.error();
    if (next_chunk_ != before) continue;
    if (chunk == nullptr) return std::optional<Message>();
    return std::optional(chunk->content.message(chunk->messages[chunk->next++]));
  }
}

// Opens the next chunk if it may have a message before `time_ns`, or if `time_ns` is nothing.
Status MessageCursor::open_until(std::optional<std::uint64_t> time_ns) {
  if (next_chunk_ == chunks_.size()) return {};
  const ChunkIndex& chunk = *chunks_[next_chunk_];
  if (time_ns && chunk.start_time_ns >= *time_ns) return {};
  ++next_chunk_;
  return open(chunk);
}

Status MessageCursor::open(const ChunkIndex& chunk) {
  Result<ChunkContent> content = reader_.chunk(chunk);
  if (!content) return content.error();
  if (open_bytes_ + content->records.size() > kMaxRecord_bytes) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}', byte {}: the chunks that overlap in time have more than {} bytes", reader_.path(),
                             chunk.offset, kMaxRecord_bytes)};
  }
  auto opened = std::make_unique<OpenChunk>();
  opened->content = *std::move(content);
  open_bytes_ += opened->content.records.size();
  for (const MessagePlace& place : opened->content.messages) {
    if (channels_.empty() || channels_.contains(place.channel_id)) opened->messages.push_back(place);
  }
  std::stable_sort(opened->messages.begin(), opened->messages.end(),
                   [](const MessagePlace& a, const MessagePlace& b) { return a.log_time_ns < b.log_time_ns; });
  open_.push_back(std::move(opened));
  return {};
}

MessageCursor::OpenChunk* MessageCursor::earliest() {
  OpenChunk* best = nullptr;
  for (const auto& chunk : open_) {
    if (chunk->next == chunk->messages.size()) continue;
    if (best == nullptr || chunk->messages[chunk->next].log_time_ns < best->messages[best->next].log_time_ns) {
      best = chunk.get();
    }
  }
  return best;
}

}  // namespace mocap::take::mcap
