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
  double before_s = 0.0;  ///< of take start and take next, as the next three
  double seconds = 0.0;
  double countdown_s = 0.0;
  std::string at;
  std::filesystem::path shots_file;     ///< of take shots import
  bool csv = false;                     ///< of take shots list
  std::string wand = "500";             ///< of calibrate wand, as the next; `seconds`: the largest duration
  cli::FloorOptions floor;              ///< of calibrate floor
  std::vector<std::string> rectangles;  ///< of mask draw, as the next
  std::vector<std::string> polygons;
  std::size_t number = 0;  ///< of mask remove, as the next
  bool all = false;
  bool dry_run = false;  ///< of calibrate wand and calibrate floor
};

/// Adds the commands that send a request to a running daemon. The parser sets `options.run` to the chosen command. Call
/// after add_subject_command() and add_take_command(), because some commands are subcommands of `subject` and `take`.
void add_live_commands(cli::App& app, LiveOptions& options);

}  // namespace mocap::ctl
