#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mocap::bench {

/// When each receiver had each frame. One thread at a time.
class Arrivals {
 public:
  /// For the frames 0 to `frames` - 1.
  Arrivals(std::size_t receivers, std::size_t frames) : frames_(frames), at_ns_(receivers * frames) {}

  /// Notes a packet that came to `receiver` at `at_ns`, which is not 0. The last packet of a frame counts: then the
  /// receiver has the whole frame. Frames that are out of range are ignored.
  void note(std::size_t receiver, std::uint64_t frame, std::int64_t at_ns) {
    if (frame < frames_) at_ns_[receiver * frames_ + frame] = at_ns;
  }
  /// 0: the frame did not come.
  std::int64_t at_ns(std::size_t receiver, std::uint64_t frame) const { return at_ns_[receiver * frames_ + frame]; }
  std::size_t receivers() const { return frames_ == 0 ? 0 : at_ns_.size() / frames_; }

 private:
  std::size_t frames_;
  std::vector<std::int64_t> at_ns_;
};

/// The frames from `first` to `last`, both included.
struct FrameRange {
  std::uint64_t first = 0, last = 0;
};

struct AddedFigures {
  double p50_us = 0.0, p99_us = 0.0, max_us = 0.0;
  std::uint64_t frames = 0;  ///< that came to a receiver
  std::uint64_t lost = 0;    ///< that the feed sent and a receiver never got
};

/// Compares the arrivals at the receivers with those at a subscriber of the feed, frame by frame. A frame that the
/// subscriber did not get has no time, but is lost if a receiver did not get it.
AddedFigures compare(const Arrivals& subscriber, const Arrivals& receivers, FrameRange range);

}  // namespace mocap::bench
