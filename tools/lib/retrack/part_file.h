#pragma once

#include <filesystem>

#include "base/result.h"

namespace mocap::retrack {

/// A file that is being written has the name ".NAME.part.mcap" beside its final name NAME.mcap, until it is whole. Its
/// writer has an exclusive lock on it (flock).
class PartFile {
 public:
  /// Removes the part that a killed process left. Fails with Busy if another process is writing it, and with Io.
  static Result<PartFile> begin(const std::filesystem::path& whole);

  PartFile(PartFile&& other) noexcept;
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;
  PartFile& operator=(PartFile&&) = delete;
  /// Removes the part, unless it was published.
  ~PartFile();

  /// The name to write to.
  const std::filesystem::path& path() const noexcept { return path_; }

  /// Gives the part its final name. Returns this name. Fails with InvalidArgument if a file of this name came
  /// meanwhile, which is kept, and with Io.
  Result<std::filesystem::path> publish();

  /// Leaves the part as it is: another process writes it.
  void forget() noexcept { path_.clear(); }

 private:
  explicit PartFile(std::filesystem::path whole);

  std::filesystem::path whole_;
  std::filesystem::path path_;  // empty: published or moved from
};

/// The name of the part of a file.
std::filesystem::path part_of(const std::filesystem::path& whole);

/// Removes the part that a killed process left of a file. Fails as PartFile::begin.
Status remove_part_of(const std::filesystem::path& whole);

}  // namespace mocap::retrack
