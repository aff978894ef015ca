#pragma once

#include <string>

#include "base/time.h"

namespace mocap::runtime {

/// Tells the service manager (systemd) how the daemon is. Does nothing where there is none: a daemon started by hand.
///
/// The main thread owns it and makes all calls.
class Service {
 public:
  Service();

  /// Everything is set up and the threads run; `status` as of now.
  void ready(const std::string& status = "started");

  /// One line for `systemctl status`.
  void status(const std::string& line);

  /// The end has begun.
  void stopping();

  /// Feeds the watchdog. Only for who has seen the pipeline make progress since the last call: a daemon whose threads
  /// hang must be found hanging.
  void alive();

  /// How often to call `alive` at least: half of what the watchdog tolerates; zero where none watches.
  Duration watchdog_interval() const noexcept { return watchdog_interval_; }

  /// Whether the journal reads our standard error.
  bool logs_to_journal() const noexcept { return logs_to_journal_; }

 private:
  Duration watchdog_interval_{};
  bool logs_to_journal_ = false;
  std::string last_status_;
};

}  // namespace mocap::runtime
