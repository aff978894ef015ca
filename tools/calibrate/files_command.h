#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "lib/cli/app.h"

namespace mocap::calibrate {

/// `mocap-calibrate export` and `import`: rigs to and from the files of other programs.
class FilesCommands {
 public:
  void add(cli::App& app);
  /// The exit code; nothing where neither was asked for.
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
