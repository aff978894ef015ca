#include "ctl/new_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

#include "base/sync_folder.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;

bool is_taken(const fs::path& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0;
}

// "folder/walk-2.c3d" for "folder/walk.c3d", or the next number that is free.
fs::path next_free(const fs::path& path) {
  for (int number = 2;; ++number) {
    fs::path next =
        path.parent_path() / fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string());
    if (!is_taken(next)) return next;
  }
}

// -1 where the file system or the machine has none: it gets its name by way of /proc.
int open_unnamed(const fs::path& path) {
  if (::access("/proc/self/fd", X_OK) != 0) return -1;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0644);
}

Error taken(const fs::path& path) {
  return {ErrorCode::InvalidArgument,
          fmt::format("{} exists and is kept; the next free name is {}", path.string(), next_free(path).string())};
}

}  // namespace

Result<NewFile> NewFile::create(fs::path path) {
  if (is_taken(path)) return taken(path);
  if (const int unnamed = open_unnamed(path); unnamed >= 0) return NewFile(std::move(path), {}, unnamed);
  return create_part(std::move(path));
}

Result<NewFile> NewFile::create_part(fs::path path) {
  for (int number = 1;; ++number) {
    fs::path part = path;
    part += fmt::format(".{}-{}.part", ::getpid(), number);
    const int file = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (file >= 0) return NewFile(std::move(path), std::move(part), file);
    // The part file of a process with the same id: the process was killed, or runs in another container.
    if (errno == EEXIST) continue;
    return Error{ErrorCode::Io, fmt::format("{} cannot be created: {}", path.string(), std::strerror(errno))};
  }
}

NewFile::NewFile(fs::path path, fs::path part, int file)
    : path_(std::move(path)), part_(std::move(part)), file_(file) {}

NewFile::NewFile(NewFile&& other) noexcept
    : path_(std::move(other.path_)), part_(std::move(other.part_)), file_(std::exchange(other.file_, -1)) {}

NewFile::~NewFile() {
  if (file_ < 0) return;
  ::close(file_);
  if (!part_.empty()) ::unlink(part_.c_str());
}

Status NewFile::append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failed("cannot be written");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Status NewFile::finish() {
  if (::fsync(file_) != 0 && errno != EINVAL && errno != EROFS) return failed("cannot be flushed to the disk");
  if (give_name() != 0) return errno == EEXIST ? taken(path_) : failed("cannot be given its name");
  ::close(std::exchange(file_, -1));
  sync_folder_of(path_);
  return {};
}

// Returns 0, or -1 with errno: EEXIST if the name exists by now.
int NewFile::give_name() const {
  if (part_.empty()) {
    const std::string unnamed = fmt::format("/proc/self/fd/{}", file_);
    return ::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, path_.c_str(), AT_SYMLINK_FOLLOW);
  }
  const int renamed = ::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE);
  if (renamed == 0 || errno != EINVAL) return renamed;
  // Some file systems cannot refuse to replace.
  if (!is_taken(path_)) return ::rename(part_.c_str(), path_.c_str());
  errno = EEXIST;
  return -1;
}

Error NewFile::failed(std::string_view what) const {
  return {ErrorCode::Io, fmt::format("{} {}: {}", path_.string(), what, std::strerror(errno))};
}

}  // namespace mocap::ctl
