#pragma once

#include <span>

namespace mocap::eval {

/// One subcommand of mocap-eval. A new one is a file pair and one line in `commands`.
struct Command {
  const char* name;
  const char* summary;
  /// Runs with its own arguments (argv[0] is the subcommand) and gives the exit code of the program.
  int (*run)(int argc, const char* const* argv);
};

/// All subcommands; the first is the one that is meant when none is named.
std::span<const Command> commands();

int run_score(int argc, const char* const* argv);
int run_points(int argc, const char* const* argv);
int run_wand(int argc, const char* const* argv);
int run_drift(int argc, const char* const* argv);
int run_labels(int argc, const char* const* argv);
int run_skeleton(int argc, const char* const* argv);
int run_scene(int argc, const char* const* argv);
int run_paper(int argc, const char* const* argv);

}  // namespace mocap::eval
