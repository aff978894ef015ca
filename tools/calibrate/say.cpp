#include "calibrate/say.h"

#include <unistd.h>

#include <csignal>

namespace mocap::calibrate {
namespace {

volatile std::sig_atomic_t end_asked = 0;

}  // namespace

bool on_terminal() { return ::isatty(STDERR_FILENO) != 0; }

void show_progress(const std::string& line) {
  if (!on_terminal()) return;
  fmt::print(stderr, "\r\x1b[2K{}", line);
  std::fflush(stderr);
}

void end_progress() { show_progress(""); }

void catch_end() {
  end_asked = 0;
  const auto count = [](int) { end_asked = end_asked + 1; };
  std::signal(SIGINT, count);
  std::signal(SIGTERM, count);
}

int ends_asked() { return end_asked; }

}  // namespace mocap::calibrate
