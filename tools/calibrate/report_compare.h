#pragma once

#include <filesystem>
#include <optional>

#include "lib/cli/app.h"

namespace mocap::calibrate {

/// `mocap-calibrate compare`: how two rigs differ, camera by camera.
class CompareCommand {
 public:
  void add(cli::App& app);
  /// The exit code; nothing where it was not asked for.
  std::optional<int> run() const;

 private:
  cli::App* command_ = nullptr;
  std::filesystem::path old_;
  std::filesystem::path new_;
  bool truth_ = false;
  bool json_ = false;
};

}  // namespace mocap::calibrate
