#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/time.h"
#include "model/health.h"

namespace mocap::runtime {

/// Tells the operator what goes wrong with one camera's images while it streams: each kind of fault when it begins,
/// with what mends it, and again once a minute while it goes on. For the publish thread, which gathers the counts.
class CameraFaults {
 public:
  static constexpr std::size_t kKinds = 7;

  /// Compares with the counts of the call before, and logs what grew.
  void tell(const CameraHealth& now, Timestamp at);

 private:
  struct Kind {
    std::uint64_t told = 0;  // the count when it was told last
    std::optional<Timestamp> told_at;
  };
  std::array<Kind, kKinds> kinds_;
};

}  // namespace mocap::runtime
