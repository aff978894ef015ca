#include "lib/retrack/part_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/move_file.h"

namespace mocap::retrack {
namespace {

namespace fs = std::filesystem;

Error cannot(const fs::path& path, const char* what) {
  return {ErrorCode::Io, fmt::format("'{}' cannot be {}: {}", path.string(), what, std::strerror(errno))};
}

}  // namespace

fs::path part_of(const fs::path& whole) {
  return whole.parent_path() / fmt::format(".{}.part{}", whole.stem().string(), whole.extension().string());
}

Status remove_part_of(const fs::path& whole) {
  const fs::path part = part_of(whole);
  // NFS gives an exclusive lock to files that are open for writing only.
  const int file = ::open(part.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) return errno == ENOENT ? Status{} : cannot(part, "opened");
  Status removed;
  if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
    removed =
        errno == EWOULDBLOCK
            ? Error{ErrorCode::Busy,
                    fmt::format("'{}' is being written by another process; wait for its end or end it", whole.string())}
            : cannot(part, "locked");
  } else if (::unlink(part.c_str()) != 0) {
    removed = cannot(part, "removed");
  }
  ::close(file);
  return removed;
}

Result<PartFile> PartFile::begin(const fs::path& whole) {
  if (const Status removed = remove_part_of(whole); !removed) return removed.error();
  return PartFile(whole);
}

PartFile::PartFile(fs::path whole) : whole_(std::move(whole)), path_(part_of(whole_)) {}

PartFile::PartFile(PartFile&& other) noexcept
    : whole_(std::move(other.whole_)), path_(std::exchange(other.path_, fs::path())) {}

PartFile::~PartFile() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

Result<fs::path> PartFile::publish() {
  if (!move_without_replacing(path_, whole_)) {
    if (errno != EEXIST) return cannot(path_, "renamed");
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}' was made by another process meanwhile, and is kept", whole_.string())};
  }
  path_.clear();
  return whole_;
}

}  // namespace mocap::retrack
