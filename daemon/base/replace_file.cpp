#include "base/replace_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "base/sync_folder.h"

namespace mocap {
namespace {

Error io_error(const std::filesystem::path& path, const char* call, int code) {
  return {ErrorCode::Io, fmt::format("{}: {} failed: {}; the file was not changed", path.string(), call,
                                     std::generic_category().message(code))};
}

Status write_all(int file, std::string_view text, const std::filesystem::path& path) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return io_error(path, "write", errno);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::fsync(file) != 0) return io_error(path, "fsync", errno);
  return {};
}

int create(const std::string& path) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC;
  const int file = ::open(path.c_str(), kFlags, 0666);
  if (file >= 0 || errno != EEXIST) return file;
  ::unlink(path.c_str());  // left by a process with the same id that was killed
  return ::open(path.c_str(), kFlags, 0666);
}

}  // namespace

Status replace_file(const std::filesystem::path& path, std::string_view text) {
  const std::string temporary = fmt::format("{}.{}.tmp", path.string(), ::getpid());
  const int file = create(temporary);
  if (file < 0) return io_error(path, "creating a file beside it", errno);
  Status status = write_all(file, text, path);
  struct stat old {};
  if (status && ::stat(path.c_str(), &old) == 0 && ::fchmod(file, old.st_mode & 07777) != 0) {
    status = io_error(path, "chmod", errno);
  }
  if (::close(file) != 0 && status) status = io_error(path, "close", errno);
  if (status && ::rename(temporary.c_str(), path.c_str()) != 0) status = io_error(path, "rename", errno);
  if (!status) {
    ::unlink(temporary.c_str());
    return status;
  }
  sync_folder_of(path);
  return {};
}

}  // namespace mocap
