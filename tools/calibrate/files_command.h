#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "lib/cli/app.h"

namespace mocap::calibrate {

/// The subcommands `export` and `import` of mocap-calibrate: rigs to and from files of other programs.
class FilesCommands {
 public:
  void add(cli::App& app);
  /// The exit code; nothing if the command line has neither subcommand.
  std::optional<int> run() const;

 private:
  int run_export() const;
  int run_import() const;

  cli::App* export_ = nullptr;
  cli::App* import_ = nullptr;
  std::filesystem::path from_;
  std::filesystem::path to_;
  std::string format_;
};

}  // namespace mocap::calibrate
