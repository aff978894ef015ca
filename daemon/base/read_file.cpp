#include "base/read_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <optional>
#include <system_error>

namespace mocap {
namespace {

constexpr std::size_t kBlock_bytes = 64 * 1024;

Error cannot_read(const std::filesystem::path& path, int code) {
  return {code == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
          fmt::format("'{}' cannot be read: {}", path.string(), std::generic_category().message(code))};
}

int open_to_read(const std::filesystem::path& path) {
  for (;;) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file >= 0 || errno != EINTR) return file;
  }
}

// Appends the bytes of an open file. Returns the error, if there is one.
std::optional<Error> append_all(int file, const std::filesystem::path& path, std::uint64_t most_bytes,
                                std::string& bytes) {
  std::array<char, kBlock_bytes> block;
  for (;;) {
    const ssize_t got = ::read(file, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return cannot_read(path, errno);
    if (got == 0) return std::nullopt;
    bytes.append(block.data(), static_cast<std::size_t>(got));
    if (bytes.size() > most_bytes) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("'{0}' has over {1} bytes, expected {1} at most", path.string(), most_bytes)};
    }
  }
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t most_bytes) {
  const int file = open_to_read(path);
  if (file < 0) return cannot_read(path, errno);
  std::string bytes;
  std::optional<Error> failed = append_all(file, path, most_bytes, bytes);
  ::close(file);
  if (failed) return *std::move(failed);
  return bytes;
}

}  // namespace mocap
