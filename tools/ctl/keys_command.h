#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "lib/cli/app.h"

namespace mocap::ctl {

struct KeysOptions {
  std::function<int()> run;    ///< of the command that was named
  std::filesystem::path file;  ///< that a new key goes to
  std::filesystem::path list = "allowed.keys";
  std::string who;  ///< a key, the file of one, or (revoke) a name
  std::string name;
  std::string role = "viewer";
  bool json = false;
};

/// `mocapctl keys new`, `allow`, `revoke` and `list`; `options.run` is then the one that was named.
void add_keys_command(cli::App& app, KeysOptions& options);

}  // namespace mocap::ctl
