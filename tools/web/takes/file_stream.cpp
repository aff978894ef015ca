#include "web/takes/file_stream.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace mocap::web {
namespace {

constexpr std::size_t kPiece_bytes = 64 * 1024;

}  // namespace

Result<std::shared_ptr<OpenFile>> OpenFile::open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) {
    return Error{errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
                 fmt::format("'{}' cannot be read: {}", path.string(), std::strerror(errno))};
  }
  struct stat status {};
  if (::fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file);
    return Error{ErrorCode::Io, fmt::format("'{}' cannot be read: expected a file", path.string())};
  }
  return std::shared_ptr<OpenFile>(new OpenFile(file, static_cast<std::uint64_t>(status.st_size)));
}

OpenFile::~OpenFile() { ::close(file_); }

std::string OpenFile::read(std::uint64_t offset, std::size_t most) const {
  std::string bytes(std::min<std::uint64_t>(most, size_ - std::min(size_, offset)), '\0');
  const ssize_t count = ::pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return bytes;
}

FileStream::FileStream(std::shared_ptr<OpenFile> file, Worker& worker, RunHere run_here,
                       std::shared_ptr<std::atomic<int>> open)
    : file_(std::move(file)), worker_(worker), run_here_(std::move(run_here)), open_(std::move(open)) {
  ++*open_;
}

void FileStream::next(std::function<void(std::string)> take) {
  const bool queued = worker_.run([self = shared_from_this(), take] {
    std::string piece = self->file_->read(self->offset_, kPiece_bytes);
    self->offset_ += piece.size();
    self->run_here_([take, piece = std::move(piece)]() mutable { take(std::move(piece)); });
  });
  if (!queued) take({});
}

}  // namespace mocap::web
