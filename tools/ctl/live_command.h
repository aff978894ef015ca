#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "lib/cli/app.h"
#include "model/control.h"

namespace mocap::ctl {

struct LiveOptions {
  std::function<int()> run;  ///< of the command that was named
  std::string endpoint = "tcp://127.0.0.1:5571";
  std::string server_key;     ///< a public key, or the file of one
  std::filesystem::path key;  ///< our own pair
  double timeout_s = 5.0;
  bool json = false;
  ControlRequest request;
  double exposure_us = 0.0;
  double gain_db = -1.0;
  std::filesystem::path subject_file;
};

/// The commands that ask a running daemon; `options.run` is then the one that was named. After add_subject_command:
/// some stand beneath `subject`.
void add_live_commands(cli::App& app, LiveOptions& options);

/// `mocapctl completion`: prints what bash needs to complete the commands of `app`.
void add_completion_command(cli::App& app, std::function<int()>& run);

}  // namespace mocap::ctl
