#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "module/recording_size.h"

namespace mocap::take {

/// Largest number of a free name, as in take-9999.jsonl.
inline constexpr int kLargestNumber = 9999;

/// Returns the number as a Protobuf varint, 1 to 10 bytes.
std::string varint(std::uint64_t number);

/// A buffered output file of records. After a failed write the file ends with the last whole record that fitted,
/// nothing more is written, and each call returns the error of that write. One thread owns it.
class OutputFile {
 public:
  /// Creates a file and never changes an existing one: if `path` exists, the first free name of `take-2.jsonl`,
  /// `take-3.jsonl` and so on is used (for `take.jsonl`), and logged. A pipe or a device is opened as it is. Fails with
  /// Io. The file has an exclusive lock (flock) while it is open: a file without one is not being written.
  static Result<OutputFile> create(const std::filesystem::path& path);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// Appends one record to a buffer, which is written to the file when it reaches 64 KiB.
  Status append(std::string_view record);
  /// Appends one record: the length of `message` as a varint, then `message`.
  Status append_delimited(std::string_view message);
  /// Appends bytes that belong to the next record: without the record they are not kept.
  Status append_head(std::string_view bytes);

  /// Writes the buffer to the file.
  Status flush();
  /// Writes the buffer, and waits until the disk has all that was written.
  Status sync();
  /// Reserves space on the disk for the next `bytes` bytes, so that their writes do not meet a full disk. Fails with Io
  /// if the disk has less space; the file is then still usable. Succeeds without effect on a file system that cannot
  /// reserve. `finish` returns space that was not used.
  Status reserve(std::uint64_t bytes);

  /// Writes the buffer, flushes the file to the disk and closes it.
  Status finish();

  const std::string& path() const noexcept { return path_; }
  RecordingSize size() const noexcept;

 private:
  OutputFile(std::string path, int file);
  Status check_open() const;
  void return_reserved() const;
  Status fail(const char* what);
  void keep_whole_records(std::size_t written_bytes);

  std::string path_;
  int file_;
  RecordingSize flushed_;
  std::string waiting_;
  std::vector<std::size_t> record_ends_;  // in waiting_
  std::optional<Error> failure_;
  std::uint64_t reserved_end_bytes_ = 0;  // the disk has space for the file up to here
};

}  // namespace mocap::take
