#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "base/result.h"

namespace mocap::take::mcap {

/// A regular file that is open for reading. Moves, but does not copy.
class InputFile {
 public:
  /// Fails with NotFound and Io; the message names the file.
  static Result<InputFile> open(const std::filesystem::path& path);

  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  const std::string& path() const noexcept { return path_; }
  /// Size when the file was opened.
  std::uint64_t size() const noexcept { return size_; }

  /// Reads `count` bytes at `offset`. Fails with InvalidArgument if the file has fewer, and with Io; the message names
  /// file and byte.
  Result<std::string> read(std::uint64_t offset, std::uint64_t count) const;

  /// Whether a process holds an exclusive lock on the file: it is being written.
  bool is_being_written() const;

 private:
  InputFile(std::string path, int file, std::uint64_t size) : path_(std::move(path)), file_(file), size_(size) {}

  std::string path_;
  int file_;
  std::uint64_t size_;
};

}  // namespace mocap::take::mcap
