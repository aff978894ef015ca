#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "base/exit_codes.h"
#include "base/result.h"

namespace mocap::calibrate {

/// The error of a command, with the exit code of the program.
struct Failure {
  int exit = kExitSoftware;
  std::string message;
};

/// Prints "mocap-calibrate: " and a line to standard error.
template <class... Arguments>
void print_message(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  fmt::print(stderr, "mocap-calibrate: {}\n", fmt::format(text, std::forward<Arguments>(arguments)...));
}

/// Shows a line that the next call overwrites; does nothing if standard error is not a terminal.
void show_progress(const std::string& line);
/// Erases the progress line.
void clear_progress();
bool on_terminal();

/// From now on, SIGINT and SIGTERM do not end the program but are counted.
void catch_signals();
/// The number of SIGINT and SIGTERM since catch_signals().
int stop_requests();

}  // namespace mocap::calibrate
