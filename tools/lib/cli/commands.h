#pragma once

#include <span>

namespace mocap::cli {

/// One subcommand of a program.
struct Command {
  const char* name;
  const char* summary;
  /// Runs the subcommand with its own arguments (argv[0] is its name) and returns the exit code of the program.
  int (*run)(int argc, const char* const* argv);
};

/// A program whose subcommands have command lines of their own. `commands` is not empty.
struct Program {
  const char* name;
  const char* about;  ///< the purpose in one line, the first of the help text
  std::span<const Command> commands;
  const char* examples;
};

/// Runs the subcommand that argv[1] names. Without a name, but with options, the first subcommand runs. Prints the
/// purpose, the subcommands and the examples for --help, the version for --version, and the subcommands for an unknown
/// name with exit code 64.
int run_command(const Program& program, int argc, const char* const* argv);

}  // namespace mocap::cli
