#include "take/mcap/edit.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/sync_folder.h"
#include "take/mcap/crc.h"
#include "take/mcap/encode_records.h"
#include "take/mcap/reader.h"
#include "take/recordings/disk_reason.h"

namespace mocap::take::mcap {
namespace {

Error system_error(const std::string& path, const std::string& what) {
  const int reason = errno;
  return {reason == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
          fmt::format("'{}' {}: {}", path, what, disk_reason(reason))};
}

// A file that this process alone may change, until the destructor.
class LockedFile {
 public:
  static Result<LockedFile> open(const std::filesystem::path& path, int flags) {
    LockedFile file(path.string(), ::open(path.c_str(), flags | O_CLOEXEC, 0644));
    if (file.file_ < 0) return system_error(path.string(), "cannot be opened for writing");
    if ((::flock(file.file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) || !file.is_at_its_path()) {
      return Error{ErrorCode::Busy,
                   fmt::format("'{}' is being written by another process; wait until it has ended", path.string())};
    }
    return file;
  }
  LockedFile(LockedFile&& other) noexcept : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;
  LockedFile& operator=(LockedFile&&) = delete;
  ~LockedFile() {
    if (file_ >= 0) ::close(file_);
  }

  int descriptor() const noexcept { return file_; }

  Status write(std::uint64_t offset, std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t done = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (done < 0 && errno == EINTR) continue;
      if (done <= 0) return system_error(path_, "cannot be written");
      bytes.remove_prefix(static_cast<std::size_t>(done));
      offset += static_cast<std::uint64_t>(done);
    }
    return {};
  }

  Status sync() const {
    if (::fsync(file_) != 0) return system_error(path_, "cannot be flushed to the disk");
    return {};
  }

  // Fails if the disk has no space for the file up to `end`.
  Status reserve(std::uint64_t begin, std::uint64_t end) const {
    const auto length = static_cast<off_t>(end - begin);
    if (::fallocate(file_, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(begin), length) == 0) return {};
    if (errno == ENOSPC || errno == EDQUOT) return system_error(path_, "cannot be changed");
    return {};
  }

 private:
  LockedFile(std::string path, int file) : path_(std::move(path)), file_(file) {}

  // Not so if another process replaced the file (repair_file) before this one had the lock.
  bool is_at_its_path() const {
    struct stat opened {};
    struct stat named {};
    return ::fstat(file_, &opened) == 0 && ::stat(path_.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
           opened.st_ino == named.st_ino;
  }

  std::string path_;
  int file_;
};

struct DataSectionEnd {
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;
};

// Where the data section of a complete file ends: its DataEnd stands before the summary.
Result<DataSectionEnd> data_end_of(const Reader& reader) {
  const InputFile& file = reader.file();
  const std::uint64_t last = file.size() - std::min<std::uint64_t>(file.size(), kFileEnd_bytes);
  const Result<std::string> tail = file.read(last, file.size() - last);
  if (!tail) return tail.error();
  // A file without an index, or whose footer has more fields, is read by a scan.
  const auto footer_record = first_record(*tail, last);
  if (!footer_record || !footer_record->is(Opcode::Footer)) {
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}' has no footer of {} bytes at its end; repair it first",
                                                         file.path(), kFileEnd_bytes)};
  }
  const Result<Footer> footer = decode<Footer>(*footer_record);
  if (!footer) return footer.error();
  const Error missing{ErrorCode::InvalidArgument, fmt::format("'{}', byte {}: no DataEnd before the summary; repair it",
                                                              file.path(), footer->summary_start)};
  if (footer->summary_start < kDataEnd_bytes) return missing;
  const std::uint64_t at = footer->summary_start - kDataEnd_bytes;
  const Result<std::string> bytes = file.read(at, kDataEnd_bytes);
  if (!bytes) return bytes.error();
  const auto record = first_record(*bytes, at);
  if (!record || !record->is(Opcode::DataEnd)) return missing;
  const Result<DataEnd> end = decode<DataEnd>(*record);
  if (!end) return end.error();
  return DataSectionEnd{at, end->data_crc};
}

// The new file of a repair: header, schemas and channels, whole records, and the index of what was written.
class RepairedFile {
 public:
  RepairedFile(LockedFile& file, const Reader& from) : file_(file), from_(from) {}

  // Schemas and channels stand before all messages, because a damaged record of one would make later messages
  // unreadable.
  Status begin() {
    std::string bytes(kMagic);
    encode(from_.header(), bytes);
    for (const auto& [id, schema] : from_.summary().schemas) {
      summary_.add(schema);
      encode(schema, bytes);
    }
    for (const auto& [id, channel] : from_.summary().channels) {
      summary_.add(channel);
      encode(channel, bytes);
    }
    return write(bytes);
  }

  // A chunk gets its message indexes again, because the last ones may be missing.
  Status add(const RawRecord& record, std::string_view bytes, const ChunkContent* content) {
    if (record.is(Opcode::Header) || record.is(Opcode::Schema) || record.is(Opcode::Channel)) return {};
    const std::uint64_t at = bytes_;
    if (const Status written = write(bytes); !written) return written;
    if (record.is(Opcode::Attachment)) {
      const Result<Attachment> one = decode<Attachment>(record);
      if (!one) return one.error();
      summary_.add(AttachmentIndex{at, record.length(), one->log_time_ns, one->create_time_ns, one->data.size(),
                                   one->name, one->media_type});
    }
    if (record.is(Opcode::Metadata)) {
      const Result<Metadata> one = decode<Metadata>(record);
      if (!one) return one.error();
      summary_.add(MetadataIndex{at, record.length(), one->name});
    }
    return content == nullptr ? Status{} : add_chunk(record, *content, at);
  }

  Status finish(const Summary& scanned) {
    if (summary_.chunks.empty()) summary_.statistics.messages = scanned.statistics.messages;
    if (const Status written = file_.write(bytes_, encode_file_end(summary_, bytes_, crc_)); !written) return written;
    return file_.sync();
  }

 private:
  Status write(std::string_view bytes) {
    if (const Status written = file_.write(bytes_, bytes); !written) return written;
    crc_ = crc32_of(bytes, crc_);
    bytes_ += bytes.size();
    return {};
  }

  Status add_chunk(const RawRecord& record, const ChunkContent& content, std::uint64_t at) {
    const Result<Chunk> chunk = decode<Chunk>(record);
    if (!chunk) return chunk.error();
    ChunkIndex index{chunk->start_time_ns, chunk->end_time_ns, at, record.length()};
    index.compression = chunk->compression;
    index.compressed_bytes = chunk->records.size();
    index.uncompressed_bytes = chunk->uncompressed_bytes;
    const std::vector<MessageIndex> messages = content.indexes();
    const std::string indexes = encode_message_indexes(messages, bytes_, index);
    summary_.add(index, messages);
    return write(indexes);
  }

  LockedFile& file_;
  const Reader& from_;
  Summary summary_;
  std::uint64_t bytes_ = 0;
  std::uint32_t crc_ = 0;
};

// The index of a file, if it is valid.
const Summary* index_of(const Reader& reader) {
  return reader.cut_off() || !reader.damages().empty() ? nullptr : &reader.summary();
}

// Writes the valid records of a file and an index to `copy`.
Result<Scan> copy_records(const Reader& reader, LockedFile& copy) {
  RepairedFile repaired(copy, reader);
  if (const Status begun = repaired.begin(); !begun) return begun.error();
  ScanVisitor visitor;
  visitor.on_record = [&](const RawRecord& record, std::string_view bytes, const ChunkContent* content) {
    return repaired.add(record, bytes, content);
  };
  Result<Scan> scanned = scan(reader.file(), visitor, index_of(reader));
  if (!scanned) return scanned;
  if (const Status finished = repaired.finish(scanned->summary); !finished) return finished.error();
  return scanned;
}

// Compares what the index says with what a scan found.
void compare(const Summary& index, const Summary& data, std::vector<Damage>& faults) {
  const auto differs = [&](const char* what, std::uint64_t said, std::uint64_t found) {
    if (said != found)
      faults.push_back({0, 0, fmt::format("byte 0: the index has {} {}, the data {}", said, what, found)});
  };
  differs("messages", index.statistics.messages, data.statistics.messages);
  differs("chunks", index.chunks.size(), data.chunks.size());
  differs("attachments", index.attachments.size(), data.attachments.size());
  differs("metadata records", index.metadata.size(), data.metadata.size());
  if (index.schemas != data.schemas) faults.push_back({0, 0, "byte 0: the index has other schemas than the data"});
  if (index.channels != data.channels) faults.push_back({0, 0, "byte 0: the index has other channels than the data"});
  for (std::size_t i = 0; i < std::min(index.chunks.size(), data.chunks.size()); ++i) {
    const ChunkIndex &said = index.chunks[i], &found = data.chunks[i];
    if (said.offset != found.offset || said.length != found.length || said.start_time_ns != found.start_time_ns ||
        said.end_time_ns != found.end_time_ns || said.message_index_offsets != found.message_index_offsets) {
      faults.push_back({found.offset, found.length,
                        fmt::format("byte {}: the index describes the chunk at byte {}", found.offset, said.offset)});
    }
  }
}

bool has_last_magic(const InputFile& file) {
  if (file.size() < kMagic.size()) return false;
  const Result<std::string> last = file.read(file.size() - kMagic.size(), kMagic.size());
  return last && *last == kMagic;
}

}  // namespace

Status add_metadata(const std::filesystem::path& path, const Metadata& metadata) {
  return add_metadata(path, [&] { return Result<Metadata>(metadata); });
}

Status add_metadata(const std::filesystem::path& path, const std::function<Result<Metadata>()>& make) {
  const Result<LockedFile> file = LockedFile::open(path, O_RDWR);
  if (!file) return file.error();
  const Result<Reader> reader = Reader::open(path);
  if (!reader) return reader.error();
  if (reader->cut_off() || !reader->damages().empty()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}' has no valid index; repair it first", path.string())};
  }
  const Result<DataSectionEnd> end = data_end_of(*reader);
  if (!end) return end.error();
  const Result<Metadata> metadata = make();
  if (!metadata) return metadata.error();
  std::string bytes;
  encode(*metadata, bytes);
  Summary summary = reader->summary();
  summary.add(MetadataIndex{end->bytes, bytes.size(), metadata->name});
  // The checksum 0 means unknown, and stays unknown.
  const std::uint32_t crc = end->crc == 0 ? 0 : crc32_of(bytes, end->crc);
  bytes += encode_file_end(summary, end->bytes + bytes.size(), crc);
  if (const Status space = file->reserve(end->bytes, end->bytes + bytes.size()); !space) return space;
  // First everything behind the old DataEnd, then the metadata over it: until the last write, a scan finds the data and
  // the DataEnd.
  const std::string_view rest = std::string_view(bytes).substr(kDataEnd_bytes);
  if (const Status written = file->write(end->bytes + kDataEnd_bytes, rest); !written) return written;
  if (const Status synced = file->sync(); !synced) return synced;
  const std::string_view first = std::string_view(bytes).substr(0, kDataEnd_bytes);
  if (const Status written = file->write(end->bytes, first); !written) return written;
  return file->sync();
}

Result<Repair> repair_file(const std::filesystem::path& path) {
  const Result<LockedFile> lock = LockedFile::open(path, O_RDWR);
  if (!lock) return lock.error();
  const Result<Reader> reader = Reader::open(path);
  if (!reader) return reader.error();
  const std::filesystem::path beside = path.parent_path() / fmt::format(".{}.repair", path.filename().string());
  Result<LockedFile> copy = LockedFile::open(beside, O_RDWR | O_CREAT | O_TRUNC);
  if (!copy) return copy.error();
  struct stat mode {};
  if (::fstat(lock->descriptor(), &mode) == 0) (void)::fchmod(copy->descriptor(), mode.st_mode & 07777);
  const Result<Scan> scanned = copy_records(*reader, *copy);
  if (!scanned || ::rename(beside.c_str(), path.c_str()) != 0) {
    const Error failed = scanned
                             ? system_error(beside.string(), fmt::format("cannot be renamed to '{}'", path.string()))
                             : scanned.error();
    ::unlink(beside.c_str());
    return failed;
  }
  sync_folder_of(path);
  Repair repair{scanned->summary.statistics.messages, 0, scanned->damages};
  if (!scanned->has_end) repair.lost_bytes = reader->file().size() - scanned->data_bytes;
  for (const Damage& damage : scanned->damages) repair.lost_bytes += damage.bytes;
  return repair;
}

Result<std::vector<Damage>> verify_file(const std::filesystem::path& path) {
  const Result<Reader> reader = Reader::open(path);
  if (!reader) return reader.error();
  const Result<Scan> scanned = scan(reader->file(), {}, index_of(*reader));
  if (!scanned) return scanned.error();
  std::vector<Damage> faults = reader->damages();
  if (faults.empty()) faults = scanned->damages;
  if (!scanned->has_end) {
    faults.push_back({scanned->data_bytes, reader->file().size() - scanned->data_bytes,
                      fmt::format("byte {}: the file is cut off", scanned->data_bytes)});
  } else if (scanned->announced_crc != 0 && scanned->announced_crc != scanned->data_crc) {
    faults.push_back(
        {scanned->data_bytes, 0, fmt::format("byte {}: the data do not have their checksum", scanned->data_bytes)});
  }
  if (scanned->has_end) compare(reader->summary(), scanned->summary, faults);
  if (scanned->has_end && !has_last_magic(reader->file())) {
    faults.push_back({reader->file().size(), 0,
                      fmt::format("byte {}: the file ends within its index; repair it", reader->file().size())});
  }
  return faults;
}

}  // namespace mocap::take::mcap
