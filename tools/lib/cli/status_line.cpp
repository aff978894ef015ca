#include "lib/cli/status_line.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace mocap::cli {

StatusLine::StatusLine() : on_terminal_(::isatty(STDERR_FILENO) != 0) {}

void StatusLine::show(std::string_view line) {
  if (!on_terminal_) return;
  shown_ = true;
  fmt::print(stderr, "\r\033[K{}", line);
  std::fflush(stderr);
}

void StatusLine::clear() {
  if (!shown_) return;
  shown_ = false;
  fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
}

}  // namespace mocap::cli
