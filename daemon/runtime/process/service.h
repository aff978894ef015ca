#pragma once

#include <string>

#include "base/time.h"

namespace mocap::runtime {

/// Reports the state of the daemon to the service manager (systemd). Does nothing if the daemon was started by hand.
///
/// The main thread owns it and makes all calls.
class Service {
 public:
  Service();

  /// Reports that all threads run. `status` is the first status line.
  void ready(const std::string& status = "started");

  /// Sets the line that `systemctl status` shows.
  void status(const std::string& line);

  /// Reports that the daemon shuts down.
  void stopping();

  /// Sends the watchdog's keep-alive. Call only if the pipeline made progress since the last call, so that the watchdog
  /// detects threads that hang.
  void alive();

  /// Longest period between calls of `alive`: half of the watchdog's timeout; zero without a watchdog.
  Duration watchdog_interval() const noexcept { return watchdog_interval_; }

  /// Returns whether standard error is connected to the journal.
  bool logs_to_journal() const noexcept { return logs_to_journal_; }

 private:
  Duration watchdog_interval_{};
  bool logs_to_journal_ = false;
  std::string last_status_;
};

}  // namespace mocap::runtime
