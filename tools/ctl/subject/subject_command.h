#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "lib/cli/app.h"

namespace mocap::ctl {

struct SubjectOptions {
  int (*run)(const SubjectOptions&) = nullptr;  ///< runs the subcommand of the command line
  std::filesystem::path file;
  std::string name;
  bool at_rest = false;            ///< import: the file is a static trial
  bool by_motion = false;          ///< import: bones are found in the motion
  bool replace = false;            ///< import, fit, draw: replaces files that exist
  std::filesystem::path skeleton;  ///< import; empty: the shipped human18
  std::filesystem::path out;       ///< import: a folder; fit, draw: a file
  std::filesystem::path stream, c3d, rest, marker_set;
  double rest_s = 0.0;
  std::uint32_t subject = 0;
  std::string date;  ///< empty: now
  bool json = false;
};

/// Adds `mocapctl subject import`, `fit`, `show` and `draw`. The parser sets `options.run` to the chosen subcommand.
void add_subject_command(cli::App& app, SubjectOptions& options);

int run_import(const SubjectOptions& options);
int run_fit(const SubjectOptions& options);
int run_show(const SubjectOptions& options);
int run_draw(const SubjectOptions& options);

}  // namespace mocap::ctl
