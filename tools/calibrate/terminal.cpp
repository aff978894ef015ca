#include "calibrate/terminal.h"

#include <unistd.h>

#include <csignal>

namespace mocap::calibrate {
namespace {

volatile std::sig_atomic_t stop_count = 0;

}  // namespace

bool on_terminal() { return ::isatty(STDERR_FILENO) != 0; }

void show_progress(const std::string& line) {
  if (!on_terminal()) return;
  fmt::print(stderr, "\r\x1b[2K{}", line);
  std::fflush(stderr);
}

void clear_progress() { show_progress(""); }

void catch_signals() {
  stop_count = 0;
  const auto count = [](int) { stop_count = stop_count + 1; };
  std::signal(SIGINT, count);
  std::signal(SIGTERM, count);
}

int stop_requests() { return stop_count; }

}  // namespace mocap::calibrate
