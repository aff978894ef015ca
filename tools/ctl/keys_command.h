#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "lib/cli/app.h"

namespace mocap::ctl {

struct KeysOptions {
  std::function<int()> run;    ///< runs the subcommand of the command line
  std::filesystem::path file;  ///< output file of `new`
  std::filesystem::path list = "allowed.keys";
  std::string who;  ///< a key, a file with a key, or (revoke) a name
  std::string name;
  std::string role = "viewer";
  bool json = false;
};

/// Adds `mocapctl keys new`, `allow`, `revoke` and `list`. The parser sets `options.run` to the chosen subcommand.
void add_keys_command(cli::App& app, KeysOptions& options);

}  // namespace mocap::ctl
