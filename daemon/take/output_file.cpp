#include "take/output_file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <google/protobuf/io/coded_stream.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace mocap::take {
namespace {

// Written to the system in pieces of this size; what is lost with the process is less than this.
constexpr std::size_t kPiece_bytes = 64 * 1024;

}  // namespace

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) {
    return Error{ErrorCode::Io,
                 fmt::format("recording '{}' cannot be opened: {}", path.string(), std::strerror(errno))};
  }
  return OutputFile(path.string(), file);
}

OutputFile::OutputFile(std::string path, int file) : path_(std::move(path)), file_(file) {
  waiting_.reserve(2 * kPiece_bytes);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      waiting_(std::move(other.waiting_)),
      failure_(std::move(other.failure_)) {}

OutputFile::~OutputFile() {
  if (file_ < 0) return;
  if (!failure_) (void)flush();
  ::close(file_);
}

Status OutputFile::append(std::string_view bytes) {
  if (const Status open = check_open(); !open) return open;
  waiting_ += bytes;
  return waiting_.size() < kPiece_bytes ? Status{} : flush();
}

Status OutputFile::append_delimited(std::string_view message) {
  using google::protobuf::io::CodedOutputStream;
  if (const Status open = check_open(); !open) return open;
  std::uint8_t length[10];
  const std::uint8_t* end = CodedOutputStream::WriteVarint64ToArray(message.size(), length);
  waiting_.append(reinterpret_cast<const char*>(length), static_cast<std::size_t>(end - length));
  return append(message);
}

Status OutputFile::finish() {
  if (const Status open = check_open(); !open) return open;
  if (const Status flushed = flush(); !flushed) return flushed;
  // A pipe or terminal has no disk to wait for (EINVAL).
  if (::fsync(file_) != 0 && errno != EINVAL && errno != EROFS) return fail("cannot be flushed to the disk");
  const int file = std::exchange(file_, -1);
  if (::close(file) != 0) return fail("cannot be closed");
  return {};
}

Status OutputFile::check_open() const {
  if (failure_) return *failure_;
  if (file_ < 0) return Error{ErrorCode::Io, fmt::format("recording '{}': is finished already", path_)};
  return {};
}

Status OutputFile::flush() {
  std::string_view rest = waiting_;
  while (!rest.empty()) {
    const ssize_t written = ::write(file_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return fail("cannot be written");
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  waiting_.clear();
  return {};
}

Status OutputFile::fail(const char* what) {
  failure_ = Error{ErrorCode::Io, fmt::format("recording '{}' {}: {}", path_, what, std::strerror(errno))};
  return *failure_;
}

}  // namespace mocap::take
