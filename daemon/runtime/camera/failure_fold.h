#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "base/time.h"

namespace mocap::runtime {

/// Folds the log lines of cameras that fail for one reason, such as the cameras of one node: the first camera that
/// fails logs the reason. The text of a reason names what failed, so equal texts are one failure. Any thread.
class FailureFold {
 public:
  /// Returns whether a camera logs `reason` at `at`: no camera did so in the last minute.
  bool is_news(const std::string& reason, Timestamp at);

  /// A camera that had failed for this reason delivers again: the next failure is news.
  void end(const std::string& reason);

 private:
  static constexpr std::size_t kMost = 64;  // over it, the oldest is logged again

  struct Logged {
    std::string reason;
    Timestamp at;
  };
  std::mutex mutex_;
  std::vector<Logged> logged_;
};

}  // namespace mocap::runtime
