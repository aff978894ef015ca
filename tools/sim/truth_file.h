#pragma once

#include <filesystem>
#include <fstream>
#include <memory>

#include "base/result.h"
#include "model/snapshot.h"
#include "scene/volume.h"

namespace mocap::sim {

/// The truth as JSON lines, one a call of `write`. One thread.
class TruthFile {
 public:
  /// Writes nothing where `file` is empty. Fails with Io when it cannot be written.
  static Result<std::unique_ptr<TruthFile>> open(const std::filesystem::path& file, const scene::Volume& volume);

  void write(double t_s, Timestamp exposed_at);

  /// Everything is in the file. Fails with Io when something was not written.
  Status finish();

 private:
  TruthFile(std::filesystem::path file, const scene::Volume& volume) : file_(std::move(file)), volume_(volume) {}

  std::filesystem::path file_;
  const scene::Volume& volume_;
  std::ofstream stream_;
  Snapshot snapshot_;
  std::uint64_t number_ = 0;
};

}  // namespace mocap::sim
