#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "base/result.h"
#include "model/snapshot.h"
#include "scene/volume.h"

namespace mocap::sim {

/// Writes the truth as JSON lines, one line for each call of write(). One thread.
class TruthFile {
 public:
  /// An empty `file` writes nothing. Fails with Io if the file cannot be created.
  static Result<std::unique_ptr<TruthFile>> open(const std::filesystem::path& file, const scene::Volume& volume);

  void write(double t_s, Timestamp exposed_at);

  /// Closes the file. Fails with Io if a write failed.
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
