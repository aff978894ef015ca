#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "take/recorder/take_buffer.h"

namespace mocap::take {

/// The largest [align] window_us: the images of a set were exposed at most so long before or after its mean.
inline constexpr Duration kLongestSet = std::chrono::seconds(1);

/// The images that were exposed just before or after a take. They wait until a snapshot of the take names them: then
/// they are part of its first or last set. The order in which an image and the snapshot of its set come is not fixed.
class EdgeImages {
 public:
  struct Image {
    std::uint32_t camera = 0;
    Timestamp at;
    std::string bytes;
  };

  /// An image outside of the take. Returns whether the newest set of the take has it; if not, a copy waits.
  bool add(const BufferedMessage& image);

  /// A set of the take. Returns the waiting images that it has; valid until the next call.
  const std::vector<Image>& take(const v1::Snapshot& set);

  /// No set of the take has an image up to this instant.
  void forget(Timestamp up_to);

  bool empty() const noexcept { return waiting_.empty(); }

 private:
  std::deque<Image> waiting_;
  std::vector<std::pair<std::uint32_t, Timestamp>> awaited_;  // by the newest set: camera and exposure
  std::vector<Image> taken_;
};

}  // namespace mocap::take
