#pragma once

#include <filesystem>
#include <optional>

#include "lib/cli/app.h"

namespace mocap::calibrate {

/// The subcommand `compare` of mocap-calibrate.
class CompareCommand {
 public:
  void add(cli::App& app);
  /// The exit code; nothing if the command line does not have the subcommand.
  std::optional<int> run() const;

 private:
  cli::App* command_ = nullptr;
  std::filesystem::path old_;
  std::filesystem::path new_;
  bool truth_ = false;
  bool json_ = false;
};

}  // namespace mocap::calibrate
