#include "audit/audit_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "audit/audit_line.h"
#include "audit/limited_writer.h"

namespace mocap::audit {
namespace {

constexpr mode_t kMode = 0640;

Error failed(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::Io, fmt::format("audit log {}: {}: {}", path.string(), what,
                                     std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
}

std::string numbered(const std::filesystem::path& path, std::uint32_t number) {
  return fmt::format("{}.{}", path.string(), number);
}

bool exists(const std::string& path) {
  struct ::stat status {};
  return ::lstat(path.c_str(), &status) == 0;
}

}  // namespace

AuditFile::AuditFile(std::filesystem::path path, std::uint64_t max_bytes, std::uint32_t keep)
    : path_(std::move(path)), max_bytes_(max_bytes), keep_(keep) {}

AuditFile::~AuditFile() { close(); }

void AuditFile::close() noexcept {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

// O_NOFOLLOW: another user of the folder must not choose the file to which the daemon appends. O_NONBLOCK: a pipe
// without a reader fails instead of waiting.
Status AuditFile::open() {
  file_ = ::open(path_.c_str(), O_RDWR | O_APPEND | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, kMode);
  if (file_ < 0) {
    return failed(path_, errno == ELOOP ? "is a symbolic link, expected a file; name another file in [audit] file"
                                        : "cannot be opened");
  }
  struct ::stat status {};
  if (::fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close();
    return Error{ErrorCode::Io,
                 fmt::format("audit log {}: is no regular file; name another file in [audit] file", path_.string())};
  }
  // The umask may have removed bits, and an older file may have more.
  if ((status.st_mode & 07777U) != kMode && status.st_uid == ::geteuid()) static_cast<void>(::fchmod(file_, kMode));
  size_bytes_ = static_cast<std::uint64_t>(status.st_size);
  return finish_last_line();
}

// A crash or a power failure may have left a line without its end.
Status AuditFile::finish_last_line() {
  char last = '\n';
  if (size_bytes_ > 0 && ::pread(file_, &last, 1, static_cast<off_t>(size_bytes_) - 1) != 1) {
    return failed(path_, "cannot be read");
  }
  return last == '\n' ? Status{} : write("\n");
}

// Not so if an operator or logrotate has moved or removed the file.
bool AuditFile::is_at_its_path() const {
  struct ::stat opened {};
  struct ::stat named {};
  return ::fstat(file_, &opened) == 0 && ::lstat(path_.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

Status AuditFile::append(const AuditEntry& entry) {
  if (file_ >= 0 && !is_at_its_path()) {
    static_cast<void>(sync());
    close();
  }
  if (file_ < 0) {
    if (Status opened = open(); !opened) {
      close();
      return opened;
    }
  }
  const std::string line = to_line(entry);
  if (size_bytes_ > 0 && size_bytes_ + line.size() > max_bytes_) {
    if (Status rotated = rotate(); !rotated) return rotated;
  }
  return write(line);
}

Status AuditFile::write(const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t now = ::write(file_, text.data() + written, text.size() - written);
    if (now < 0 && errno == EINTR) continue;
    if (now < 0) {
      const Error error = failed(path_, "cannot be written; free space on the disk");
      // A line in part would be unreadable together with the next one.
      if (written > 0 && ::ftruncate(file_, static_cast<off_t>(size_bytes_)) != 0) close();
      return error;
    }
    written += static_cast<std::size_t>(now);
  }
  size_bytes_ += written;
  return {};
}

// Only the files before the first free number get a new number: a rotation that failed leaves a number free, so that
// its retries delete no older file.
Status AuditFile::rotate() {
  std::uint32_t last = 1;
  while (last < keep_ && exists(numbered(path_, last))) ++last;
  for (; last > 0; --last) {
    const std::string from = last > 1 ? numbered(path_, last - 1) : path_.string(), to = numbered(path_, last);
    // Moved away by another process: nothing to rename.
    if (::rename(from.c_str(), to.c_str()) == 0 || errno == ENOENT) continue;
    return failed(from, fmt::format("cannot be renamed to {}; let the daemon write to its folder, and move away what "
                                    "has that name",
                                    to));
  }
  static_cast<void>(sync());
  close();
  return open();
}

Status AuditFile::sync() {
  if (file_ >= 0 && ::fdatasync(file_) != 0) return failed(path_, "cannot be flushed to the disk");
  return {};
}

std::unique_ptr<AuditWriter> make_audit_writer(const AuditSettings& settings) {
  if (!settings.writes()) return nullptr;
  return std::make_unique<LimitedWriter>(
      std::make_unique<AuditFile>(settings.file, settings.max_mb * 1'000'000, settings.keep));
}

}  // namespace mocap::audit
