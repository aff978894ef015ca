#include "take/recordings/output_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <google/protobuf/io/coded_stream.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>

#include "base/log.h"
#include "base/sync_folder.h"
#include "take/recordings/disk_reason.h"

namespace mocap::take {
namespace {

// Size of the pieces written to the file. A crash of the process loses at most one piece.
constexpr std::size_t kPiece_bytes = 64 * 1024;

// Space is reserved in steps of this size while the disk has it: one system call for many pieces.
constexpr std::uint64_t kReserve_bytes = 1024 * 1024;

Error cannot_open(const std::filesystem::path& path) {
  const int reason = errno;
  return {ErrorCode::Io, fmt::format("recording '{}' cannot be opened: {}{}", path.string(), disk_reason(reason),
                                     reason == ENOENT ? "; make its folder" : "")};
}

// Returns -1 and sets errno to EEXIST if the path exists.
int open_new(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
}

// Returns whether the path is neither a regular file nor a link to one nor a link to nothing.
bool is_pipe_or_device(const std::filesystem::path& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

// Returns "folder/take-2.jsonl" for "folder/take.jsonl" and 2.
std::filesystem::path numbered(const std::filesystem::path& path, int number) {
  return path.parent_path() / fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string());
}

}  // namespace

std::string varint(std::uint64_t number) {
  std::uint8_t bytes[10];
  const std::uint8_t* end = google::protobuf::io::CodedOutputStream::WriteVarint64ToArray(number, bytes);
  return {reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(end - bytes)};
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  std::filesystem::path name = path;
  int file = is_pipe_or_device(path) ? ::open(path.c_str(), O_WRONLY | O_CLOEXEC) : open_new(path);
  for (int number = 2; file < 0 && errno == EEXIST && number <= kLargestNumber; ++number) {
    name = numbered(path, number);
    file = open_new(name);
  }
  if (file < 0) return cannot_open(name);
  sync_folder_of(name);
  (void)::flock(file, LOCK_EX | LOCK_NB);  // a pipe or a device may refuse
  const std::string why = name == path ? "" : fmt::format(", because '{}' exists", path.string());
  log_info("record", fmt::format("writes to '{}'{}", name.string(), why));
  return OutputFile(name.string(), file);
}

OutputFile::OutputFile(std::string path, int file) : path_(std::move(path)), file_(file) {
  waiting_.reserve(2 * kPiece_bytes);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      flushed_(other.flushed_),
      waiting_(std::move(other.waiting_)),
      record_ends_(std::move(other.record_ends_)),
      failure_(std::move(other.failure_)),
      reserved_end_bytes_(other.reserved_end_bytes_) {}

OutputFile::~OutputFile() {
  if (file_ < 0) return;
  if (!failure_) (void)flush();
  return_reserved();
  ::close(file_);
}

RecordingSize OutputFile::size() const noexcept {
  return {flushed_.bytes + waiting_.size(), flushed_.records + record_ends_.size()};
}

Status OutputFile::append(std::string_view record) {
  if (const Status open = check_open(); !open) return open;
  waiting_ += record;
  record_ends_.push_back(waiting_.size());
  return waiting_.size() < kPiece_bytes ? Status{} : flush();
}

Status OutputFile::append_head(std::string_view bytes) {
  if (const Status open = check_open(); !open) return open;
  waiting_ += bytes;
  return {};
}

Status OutputFile::append_delimited(std::string_view message) {
  if (const Status appended = append_head(varint(message.size())); !appended) return appended;
  return append(message);
}

Status OutputFile::finish() {
  if (const Status flushed = flush(); !flushed) return flushed;
  // fsync of a pipe or a terminal fails with EINVAL; there is no disk to wait for.
  if (::fsync(file_) != 0 && errno != EINVAL && errno != EROFS) return fail("cannot be flushed to the disk");
  return_reserved();
  const int file = std::exchange(file_, -1);
  if (::close(file) != 0) return fail("cannot be closed");
  return {};
}

Status OutputFile::check_open() const {
  if (failure_) return *failure_;
  if (file_ < 0) return Error{ErrorCode::Io, fmt::format("recording '{}': is closed already", path_)};
  return {};
}

// Ends the file at its last byte, which frees the space behind that byte.
void OutputFile::return_reserved() const {
  if (reserved_end_bytes_ > flushed_.bytes) (void)!::ftruncate(file_, static_cast<off_t>(flushed_.bytes));
}

Status OutputFile::sync() {
  if (const Status flushed = flush(); !flushed) return flushed;
  if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) return fail("cannot be flushed to the disk");
  return {};
}

Status OutputFile::reserve(std::uint64_t bytes) {
  if (const Status open = check_open(); !open) return open;
  const std::uint64_t begin = flushed_.bytes, end = size().bytes + bytes;
  if (end <= reserved_end_bytes_) return {};
  for (const std::uint64_t step : {kReserve_bytes, std::uint64_t{0}}) {
    if (::fallocate(file_, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(begin), static_cast<off_t>(end + step - begin)) ==
        0) {
      reserved_end_bytes_ = end + step;
      return {};
    }
    if (errno != ENOSPC && errno != EDQUOT) return {};  // a file system that cannot reserve, a pipe, a device
  }
  return Error{ErrorCode::Io, fmt::format("recording '{}': the disk has no space for {} more bytes: {}", path_, bytes,
                                          disk_reason(errno))};
}

Status OutputFile::flush() {
  if (const Status open = check_open(); !open) return open;
  std::size_t done = 0;
  while (done < waiting_.size()) {
    const ssize_t written = ::write(file_, waiting_.data() + done, waiting_.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      Status failed = fail("cannot be written");
      keep_whole_records(done);
      return failed;
    }
    done += static_cast<std::size_t>(written);
  }
  flushed_ = size();
  waiting_.clear();
  record_ends_.clear();
  return {};
}

// Ends the file after the last whole record of which the first `written_bytes` of the buffer were written. A pipe or a
// device cannot be shortened; its reader ignores the incomplete record.
void OutputFile::keep_whole_records(std::size_t written_bytes) {
  const auto end = std::upper_bound(record_ends_.begin(), record_ends_.end(), written_bytes);
  if (end != record_ends_.begin()) flushed_.bytes += *std::prev(end);
  flushed_.records += static_cast<std::uint64_t>(end - record_ends_.begin());
  waiting_.clear();
  record_ends_.clear();
  if (::ftruncate(file_, static_cast<off_t>(flushed_.bytes)) != 0 && errno != EINVAL) {
    log_warn("record", fmt::format("'{}' ends with an incomplete record: {}", path_, std::strerror(errno)));
  }
}

Status OutputFile::fail(const char* what) {
  failure_ = Error{ErrorCode::Io, fmt::format("recording '{}' {}: {}", path_, what, disk_reason(errno))};
  return *failure_;
}

}  // namespace mocap::take
