#pragma once

#include <cstdint>
#include <optional>

#include "base/time.h"
#include "model/clock/timecode_clock.h"

namespace mocap::timecode {

/// One frame of LTC as it was decoded; its numbers may be wrong.
struct LtcFrame {
  Timecode timecode;     ///< hours to frames and drop_frame
  Timestamp starts_at;   ///< of its first bit, on the host's clock
  bool reverse = false;  ///< played backwards
};

enum class LtcVerdict {
  Accepted,       ///< agrees with the clock
  Disagrees,      ///< is another timecode, or there is no clock yet
  OtherCounting,  ///< drop-frame instead of non-drop, or the other way round
  Impossible,     ///< a number is out of range for the rate
  Reverse,
};

/// Relates the host's clock to timecode from noisy LTC frames: a Kalman filter of the position and of the rate's
/// deviation. A frame that disagrees is left out; kLockFrames frames that disagree in the same way are a jump of the
/// source, which the clock follows. Without frames the clock goes on at the measured rate. Reads no clock.
class FlyWheel {
 public:
  /// Frames that must agree with each other before the clock follows them. A decoder that reads noise gives two wrong
  /// frames in a row in 5 % of the frames (30 frames/s, noise 39 %), five that count on have not been seen.
  static constexpr int kLockFrames = 5;

  /// `format`: rate and counting.
  explicit FlyWheel(const Timecode& format);

  LtcVerdict add(const LtcFrame& frame);

  /// Empty until the first lock. `valid_until` and `exposures_per_s` are not set.
  const std::optional<TimecodeClock>& clock() const noexcept { return clock_; }
  /// Start of the last accepted frame.
  std::optional<Timestamp> last_accepted_at() const noexcept { return last_accepted_at_; }
  /// Deviation of the source's rate from its nominal rate on the host's clock; positive: the source is fast.
  double drift_ppm() const noexcept { return 1e6 * deviation_; }
  /// Frames per second of the last frames that count on, whether accepted or not; empty: too few.
  std::optional<double> heard_rate_hz() const noexcept;

  std::uint64_t accepted() const noexcept { return accepted_; }
  std::uint64_t rejected() const noexcept { return rejected_; }
  /// Changes of the clock to another timecode after the first lock.
  std::uint64_t jumps() const noexcept { return jumps_; }

 private:
  /// Frames that count on, one number each.
  struct Run {
    std::int64_t first = 0, last = 0;
    Timestamp first_at, last_at;
    int frames = 0;
  };

  LtcVerdict judge(const LtcFrame& frame);
  void listen(std::int64_t number, Timestamp at);
  bool agrees(std::int64_t number, Timestamp at) const;
  void follow(std::int64_t number, Timestamp at);
  bool jump_is_sure(std::int64_t number, Timestamp at);
  void jump(std::int64_t number, Timestamp at);
  double difference(double one, double other) const;
  double frames_between(Timestamp from, Timestamp to) const;

  Timecode format_;
  double rate_hz_;  // nominal
  std::optional<TimecodeClock> clock_;
  double deviation_ = 0.0;
  double position_variance_ = 0.0, covariance_ = 0.0, deviation_variance_;
  std::optional<Timestamp> last_accepted_at_;
  Run heard_;      // all frames
  Run candidate_;  // frames that disagree with the clock and agree with each other
  std::uint64_t accepted_ = 0, rejected_ = 0, jumps_ = 0;
};

}  // namespace mocap::timecode
