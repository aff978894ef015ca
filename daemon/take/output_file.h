#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::take {

/// A file that grows piece by piece. After a failed write it is not written to again, and each call gives that error.
/// One thread owns it.
class OutputFile {
 public:
  /// Opens `path`; what stood there is gone. Fails with Io.
  static Result<OutputFile> create(const std::filesystem::path& path);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// What was appended is written to the system in pieces.
  Status append(std::string_view bytes);
  /// A message with its length before it, as a varint.
  Status append_delimited(std::string_view message);

  /// Everything is on its way to the disk; the file is closed.
  Status finish();

 private:
  OutputFile(std::string path, int file);
  Status check_open() const;
  Status flush();
  Status fail(const char* what);

  std::string path_;
  int file_;
  std::string waiting_;
  std::optional<Error> failure_;
};

}  // namespace mocap::take
