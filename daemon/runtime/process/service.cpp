#include "runtime/process/service.h"

#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace mocap::runtime {
namespace {

// Replaces newlines: a newline starts another field of the message.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// $JOURNAL_STREAM has device and inode of the stream that systemd connected to the journal (systemd.exec(5)). They
// differ from those of standard error if standard error was redirected later.
bool stderr_is_the_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat stderr_status {};
  if (stream == nullptr || ::fstat(STDERR_FILENO, &stderr_status) != 0) return false;
  return std::to_string(stderr_status.st_dev) + ":" + std::to_string(stderr_status.st_ino) == stream;
}

Duration half_the_watchdog() {
  std::uint64_t patience_us = 0;
  if (::sd_watchdog_enabled(0, &patience_us) <= 0) return Duration{0};
  return std::chrono::microseconds(patience_us / 2);
}

}  // namespace

// Failed notifications are ignored: the service manager has its own timeouts.

Service::Service() : watchdog_interval_(half_the_watchdog()), logs_to_journal_(stderr_is_the_journal()) {}

void Service::ready(const std::string& status) {
  last_status_ = one_line(status);
  static_cast<void>(::sd_notify(0, ("READY=1\nSTATUS=" + last_status_).c_str()));
}

void Service::status(const std::string& line) {
  std::string fresh = one_line(line);
  if (fresh == last_status_) return;
  last_status_ = std::move(fresh);
  static_cast<void>(::sd_notify(0, ("STATUS=" + last_status_).c_str()));
}

void Service::stopping() { static_cast<void>(::sd_notify(0, "STOPPING=1\nSTATUS=stopping")); }

void Service::alive() { static_cast<void>(::sd_notify(0, "WATCHDOG=1")); }

}  // namespace mocap::runtime
