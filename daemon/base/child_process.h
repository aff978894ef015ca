#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace mocap {

/// How a process ended.
struct ProcessEnd {
  int exit_code = 0;  ///< 0 if a signal ended it
  int signal = 0;     ///< 0: none

  bool well() const noexcept { return exit_code == 0 && signal == 0; }
};

/// A child process whose standard output and standard error the caller reads as lines. Its standard input is empty. One
/// thread owns it.
class ChildProcess {
 public:
  /// Runs `command`, whose first word is a path, or a name that $PATH finds. Fails with NotFound and Io.
  static Result<ChildProcess> start(const std::vector<std::string>& command);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ChildProcess& operator=(ChildProcess&&) = delete;
  /// Kills the process if it was not waited for.
  ~ChildProcess();

  pid_t id() const noexcept { return id_; }
  /// Readable (poll) when `read` has something to do.
  int descriptor() const noexcept { return output_; }

  /// Reads once and returns the lines that are complete; blocks if there is nothing to read. At the end of the output,
  /// returns a last line without a newline, if there is one. Returns nothing after that. A line over 64 KiB is split.
  std::optional<std::vector<std::string>> read();

  /// Runs `command` and returns what it printed, whatever its exit code. Fails as start(), and with Timeout after
  /// `patience`: the process is killed.
  static Result<std::string> output_of(const std::vector<std::string>& command, Duration patience);

  void send(int signal) const noexcept;
  /// Waits for the end.
  ProcessEnd wait();

 private:
  ChildProcess(pid_t id, int output) : id_(id), output_(output) {}

  pid_t id_;  // 0: waited for or moved from
  int output_;
  bool closed_ = false;
  std::string begun_;  // line without an end
};

}  // namespace mocap
