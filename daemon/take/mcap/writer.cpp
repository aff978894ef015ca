#include "take/mcap/writer.h"

#include <fmt/core.h>

#include <algorithm>

#include "base/expects.h"
#include "take/mcap/chunk_content.h"
#include "take/mcap/crc.h"
#include "take/mcap/encode_records.h"

namespace mocap::take::mcap {
namespace {

// Space that stays reserved beside the index, for metadata that are added before the end. Twice their bound, because a
// file system has blocks of its own size.
constexpr std::uint64_t kSpare_bytes = 2 * kMaxLastMetadata_bytes;

// Bounds of the size of index records besides their texts.
constexpr std::uint64_t kIndexRecord_bytes = 128;
constexpr std::uint64_t kIndexEntry_bytes = 16;

}  // namespace

Writer::Writer(OutputFile file, WriterSettings settings)
    : file_(std::move(file)), settings_(settings), compressor_(settings.compression) {
  chunk_.reserve(settings.chunk_bytes + settings.chunk_bytes / 4);
}

Result<Writer> Writer::create(const std::filesystem::path& path, const Header& header, WriterSettings settings) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  Writer writer(*std::move(file), settings);
  std::string bytes(kMagic);
  encode(header, bytes);
  if (const Status reserved = writer.reserve(bytes.size()); !reserved) return reserved.error();
  if (const Status written = writer.write(bytes); !written) return written.error();
  return writer;
}

Result<std::uint16_t> Writer::add_schema(std::string name, std::string encoding, std::string data) {
  const auto id = static_cast<std::uint16_t>(summary_.schemas.size() + 1);
  summary_.add(Schema{id, std::move(name), std::move(encoding), std::move(data)});
  bytes_.clear();
  encode(summary_.schemas.at(id), bytes_);
  summary_bytes_ += bytes_.size();
  if (const Status written = write(bytes_); !written) return written.error();
  return id;
}

Result<std::uint16_t> Writer::add_channel(std::string topic, std::string message_encoding, std::uint16_t schema) {
  const auto id = static_cast<std::uint16_t>(summary_.channels.size());
  summary_.add(Channel{id, schema, std::move(topic), std::move(message_encoding), {}});
  sequences_.push_back(0);
  chunk_messages_.push_back({id, {}});
  bytes_.clear();
  encode(summary_.channels.at(id), bytes_);
  summary_bytes_ += bytes_.size();
  if (const Status written = write(bytes_); !written) return written.error();
  return id;
}

Status Writer::add_attachment(const Attachment& attachment) {
  bytes_.clear();
  encode(attachment, bytes_);
  summary_bytes_ += kIndexRecord_bytes + attachment.name.size() + attachment.media_type.size();
  const std::uint64_t at = written_bytes_;
  if (const Status reserved = reserve(bytes_.size()); !reserved) return reserved;
  if (const Status written = write(bytes_); !written) return written;
  summary_.add(AttachmentIndex{at, bytes_.size(), attachment.log_time_ns, attachment.create_time_ns,
                               attachment.data.size(), attachment.name, attachment.media_type});
  return {};
}

Status Writer::add_metadata(const Metadata& metadata) {
  bytes_.clear();
  encode(metadata, bytes_);
  summary_bytes_ += kIndexRecord_bytes + metadata.name.size();
  const std::uint64_t at = written_bytes_;
  // Small metadata fit into the spare space when the disk is full.
  if (const Status reserved = reserve(bytes_.size()); !reserved && bytes_.size() > kMaxLastMetadata_bytes) {
    return reserved;
  }
  if (const Status written = write(bytes_); !written) return written;
  summary_.add(MetadataIndex{at, bytes_.size(), metadata.name});
  return {};
}

Status Writer::append(std::uint16_t channel, std::uint64_t log_time_ns, std::string_view data) {
  MOCAP_EXPECTS(channel < sequences_.size());
  if (failure_) return *failure_;
  if (data.size() > kMaxRecord_bytes / 2) {
    return Error{ErrorCode::InvalidArgument, fmt::format("recording '{}': a message of {} bytes, expected at most {}",
                                                         path(), data.size(), kMaxRecord_bytes / 2)};
  }
  if (!chunk_.empty()) {
    const std::uint64_t start = std::min(chunk_start_ns_, log_time_ns), end = std::max(chunk_end_ns_, log_time_ns);
    const bool long_enough = end - start >= static_cast<std::uint64_t>(settings_.chunk_span.count());
    if (long_enough || chunk_.size() + data.size() > settings_.chunk_bytes) {
      if (const Status written = write_chunk(); !written) return written;
    }
  }
  const bool first = chunk_.empty();
  chunk_start_ns_ = first ? log_time_ns : std::min(chunk_start_ns_, log_time_ns);
  chunk_end_ns_ = first ? log_time_ns : std::max(chunk_end_ns_, log_time_ns);
  chunk_messages_[channel].entries.emplace_back(log_time_ns, chunk_.size());
  encode(Message{channel, sequences_[channel]++, log_time_ns, log_time_ns, data}, chunk_);
  return {};
}

Status Writer::write_chunk() {
  if (failure_) return *failure_;
  if (chunk_.empty()) return {};
  const Chunk chunk{chunk_start_ns_,
                    chunk_end_ns_,
                    chunk_.size(),
                    crc32_of(chunk_),
                    std::string(name_of(settings_.compression)),
                    compressor_.compress(chunk_)};
  bytes_.clear();
  encode(chunk, bytes_);
  ChunkIndex index{chunk.start_time_ns, chunk.end_time_ns, written_bytes_, bytes_.size()};
  index.compression = chunk.compression;
  index.compressed_bytes = chunk.records.size();
  index.uncompressed_bytes = chunk.uncompressed_bytes;
  bytes_ += encode_message_indexes(chunk_messages_, written_bytes_ + bytes_.size(), index);
  summary_bytes_ += kIndexRecord_bytes + kIndexEntry_bytes * index.message_index_offsets.size();
  if (const Status reserved = reserve(bytes_.size()); !reserved) return reserved;
  if (const Status written = write(bytes_); !written) return written;
  summary_.add(index, chunk_messages_);
  chunk_.clear();
  for (MessageIndex& one : chunk_messages_) one.entries.clear();
  if (!settings_.sync) return {};
  if (const Status synced = file_.sync(); !synced) return fail(synced.error());
  return {};
}

// Makes sure that the disk has space for `bytes` bytes and for the end of the file.
Status Writer::reserve(std::uint64_t bytes) {
  if (failure_) return *failure_;
  if (const Status reserved = file_.reserve(bytes + summary_bytes_ + kSpare_bytes); !reserved) {
    return fail(reserved.error());
  }
  return {};
}

Status Writer::write(std::string_view bytes) {
  if (const Status appended = file_.append(bytes); !appended) return fail(appended.error());
  if (const Status flushed = file_.flush(); !flushed) return fail(flushed.error());
  written_bytes_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
  return {};
}

// The first error ends the recording; the open chunk is lost.
Status Writer::fail(Error error) {
  if (!failure_) failure_ = std::move(error);
  chunk_.clear();
  for (MessageIndex& one : chunk_messages_) one.entries.clear();
  return *failure_;
}

Status Writer::finish() {
  const Status chunk = write_chunk();
  if (const Status appended = file_.append(encode_file_end(summary_, written_bytes_, crc_)); !appended) return appended;
  if (const Status finished = file_.finish(); !finished) return finished;
  return chunk;
}

RecordingSize Writer::size() const noexcept {
  RecordingSize size{written_bytes_, summary_.statistics.messages};
  size.bytes += chunk_.size();
  for (const MessageIndex& one : chunk_messages_) size.records += one.entries.size();
  return size;
}

std::optional<std::uint64_t> Writer::open_since_ns() const noexcept {
  if (chunk_.empty()) return std::nullopt;
  return chunk_start_ns_;
}

}  // namespace mocap::take::mcap
