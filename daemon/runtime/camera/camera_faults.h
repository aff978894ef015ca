#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/time.h"
#include "model/health.h"

namespace mocap::runtime {

/// Logs faults in the images of one camera while it streams: each kind of fault when it begins, with a remedy, and
/// again once a minute while it lasts. The publish thread, which collects the counts, owns it.
class CameraFaults {
 public:
  static constexpr std::size_t kKinds = 7;

  /// Compares the counts with those last logged, and logs the increases. The counts of a camera that was replaced begin
  /// at 0 again.
  void report(const CameraHealth& now, Timestamp at);

 private:
  struct Kind {
    std::uint64_t logged = 0;  // count in the last log line
    std::optional<Timestamp> logged_at;
  };
  std::array<Kind, kKinds> kinds_;
};

}  // namespace mocap::runtime
