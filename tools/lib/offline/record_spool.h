#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace mocap::offline {

/// Records in a file without a name, which vanishes with the object. Any record can be read back. One thread.
class RecordSpool {
 public:
  /// The file is in `folder`. Fails with Io.
  static Result<RecordSpool> create(const std::filesystem::path& folder);
  RecordSpool(RecordSpool&& other) noexcept;
  RecordSpool(const RecordSpool&) = delete;
  RecordSpool& operator=(const RecordSpool&) = delete;
  RecordSpool& operator=(RecordSpool&&) = delete;
  ~RecordSpool();

  /// Fails with Io.
  Status append(std::string_view record);

  /// Precondition: index < size(). Fails with Io.
  Result<std::string> read(std::size_t index) const;

  std::size_t size() const noexcept { return ends_.size(); }

 private:
  RecordSpool(int file, std::string folder) : file_(file), folder_(std::move(folder)) {}
  Error failed(const char* what) const;

  int file_;
  std::string folder_;
  std::vector<std::uint64_t> ends_;  // by record: offset of its last byte + 1
};

}  // namespace mocap::offline
