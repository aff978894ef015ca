#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "base/result.h"
#include "lib/retrack/part_file.h"
#include "take/take_info.h"
#include "take/take_writer.h"

namespace mocap::retrack {

/// A take that is being written. It has its name from `finish` on; before, it is a PartFile.
class PartTake {
 public:
  /// Fails as PartFile::begin and TakeWriter::create do.
  static Result<PartTake> create(const std::filesystem::path& path, const take::TakeStart& start);

  take::TakeWriter& writer() noexcept { return *writer_; }

  /// Writes the index, and gives the file its name. Returns the path. Fails as PartFile::publish and with Io.
  Result<std::string> finish(const take::TakeInfo& info);

 private:
  PartTake(PartFile part, std::unique_ptr<take::TakeWriter> writer)
      : part_(std::move(part)), writer_(std::move(writer)) {}

  PartFile part_;  // outlives the writer
  std::unique_ptr<take::TakeWriter> writer_;
};

}  // namespace mocap::retrack
