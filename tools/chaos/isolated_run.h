#pragma once

#include <sys/types.h>

#include <filesystem>

#include "base/result.h"
#include "chaos/run_episode.h"

namespace mocap::chaos {

/// An episode that runs in a process of its own, so that a crash or an endless loop is a finding like others.
class IsolatedRun {
 public:
  /// Starts run_twice. Fails with Io if no process can be started.
  static Result<IsolatedRun> start(const Episode& episode, const std::filesystem::path& folder);
  IsolatedRun(IsolatedRun&& other) noexcept;
  IsolatedRun& operator=(IsolatedRun&& other) noexcept;
  ~IsolatedRun();

  /// Readable when the run has ended.
  int file() const noexcept { return result_; }
  /// Waits for the end. A crash is the failure of the invariant "the daemon does not crash". Fails with the error of
  /// run_twice. One call.
  Result<Verdict> finish();

 private:
  IsolatedRun(pid_t process, int result, int log) : process_(process), result_(result), log_(log) {}
  void close_files() noexcept;

  pid_t process_;
  int result_;  // a pipe
  int log_;     // standard error of the process
};

}  // namespace mocap::chaos
