#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lib/cli/app.h"

namespace mocap::ctl {

struct TakeOptions {
  std::function<int()> run;                  ///< runs the subcommand of the command line
  std::vector<std::filesystem::path> files;  ///< `list`: also folders
  std::filesystem::path file;                ///< `rename`
  std::string text;                          ///< notes, or the new name
  int rating = 0;
  bool yes = false;
  bool json = false;
};

/// Adds `mocapctl take list`, `show`, `verify`, `repair`, `note`, `rate`, `rename` and `delete`, which work on files.
/// The parser sets `options.run` to the chosen subcommand.
void add_take_command(cli::App& app, TakeOptions& options);

}  // namespace mocap::ctl
