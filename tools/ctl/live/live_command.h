#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lib/cli/app.h"
#include "lib/cli/floor_options.h"
#include "lib/cli/key_options.h"
#include "model/control.h"

namespace mocap::ctl {

struct LiveOptions {
  std::function<int()> run;  ///< runs the command of the command line
  std::string endpoint = "tcp://127.0.0.1:5571";
  cli::KeyOptions keys;
  double timeout_s = 5.0;
  bool json = false;
  ControlRequest request;
  double exposure_us = 0.0;
  double gain_db = -1.0;
  std::filesystem::path subject_file;
  double before_s = 0.0;                ///< take start, take next
  double seconds = 0.0;                 ///< take start, take next: length; calibrate wand: largest duration
  double countdown_s = 0.0;             ///< take start, take next
  std::string at;                       ///< take start, take next
  std::filesystem::path shots_file;     ///< take shots import
  bool csv = false;                     ///< take shots list
  std::string wand = "500";             ///< calibrate wand
  cli::FloorOptions floor;              ///< calibrate floor
  std::vector<std::string> rectangles;  ///< mask draw
  std::vector<std::string> polygons;    ///< mask draw
  std::size_t number = 0;               ///< mask remove
  bool all = false;                     ///< mask remove
  bool dry_run = false;                 ///< calibrate wand, calibrate floor
};

/// Adds the commands that send a request to a running daemon. The parser sets `options.run` to the chosen command. Call
/// after add_subject_command() and add_take_command(), because some commands are subcommands of `subject` and `take`.
void add_live_commands(cli::App& app, LiveOptions& options);

}  // namespace mocap::ctl
