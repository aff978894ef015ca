#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "base/exit_codes.h"
#include "base/result.h"

namespace mocap::calibrate {

inline constexpr int kExitData = 65;     ///< sysexits EX_DATAERR: what was seen is refused
inline constexpr int kExitNoInput = 66;  ///< sysexits EX_NOINPUT: a file that is named is not there

/// Why a command ends, and how.
struct Failure {
  int exit = kExitSoftware;
  std::string message;
};

/// A line of the program's own to standard error.
template <class... Arguments>
void say(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  fmt::print(stderr, "mocap-calibrate: {}\n", fmt::format(text, std::forward<Arguments>(arguments)...));
}

/// One line that is written over on a terminal; elsewhere nothing.
void show_progress(const std::string& line);
/// Takes that line away.
void end_progress();
bool on_terminal();

/// From now on SIGINT and SIGTERM are counted, not obeyed.
void catch_end();
int ends_asked();

}  // namespace mocap::calibrate
