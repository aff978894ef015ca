#include "calibrate/terminal.h"

#include <csignal>

#include "lib/cli/status_line.h"

namespace mocap::calibrate {
namespace {

volatile std::sig_atomic_t stop_count = 0;

cli::StatusLine& progress_line() {
  static cli::StatusLine line;
  return line;
}

}  // namespace

bool on_terminal() { return progress_line().on_terminal(); }

void show_progress(const std::string& line) { progress_line().show(line); }

void clear_progress() { progress_line().clear(); }

void catch_signals() {
  stop_count = 0;
  const auto count = [](int) { stop_count = stop_count + 1; };
  std::signal(SIGINT, count);
  std::signal(SIGTERM, count);
}

int stop_requests() { return stop_count; }

}  // namespace mocap::calibrate
