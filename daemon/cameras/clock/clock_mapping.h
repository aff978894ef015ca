#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/bounded_vector.h"
#include "base/time.h"

namespace mocap::cameras {

/// Converts time stamps of a camera's clock to the host's clock.
///
/// A frame arrives some time after its stamp: a constant minimum delay and a variable delay of at least 0. Each sample
/// is (camera time, time of receipt minus camera time), so all samples are above the line that describes the camera's
/// clock. The estimated line is the edge of their lower convex hull that spans the middle of the window: the best line
/// below all samples for any law of one-sided delays, and the maximum likelihood estimate for exponential delays. The
/// minimum delay is not observable; the caller subtracts it if it is known.
///
/// The window is 32 s. Of each half second only the sample nearest to the line is kept. Never allocates; takes some 100
/// ns per frame. Deterministic. One thread. See decisions/0005.
///
/// Source: Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements" (INFOCOM
/// 1999); the hull is Andrew's monotone chain.
class ClockMapping {
 public:
  /// Adds one frame and returns the host's time of its stamp, plus the minimum delay; never later than `received`. If
  /// the camera's clock wraps, runs backwards or jumps, the offset is estimated again and the drift is kept, because
  /// the crystal is the same. If the clock stands still, the result is `received`.
  Timestamp map(Duration camera_time, Timestamp received);

  /// Forgets everything. Call this when the camera was started again.
  void reset();

  /// Estimated drift: seconds that the host's clock gains per second of the camera's clock; within 500 ppm.
  double drift() const { return line_.slope; }

  /// Estimated standard deviation of the last result about the true time plus the minimum delay. 1 to 2 times the real
  /// error for exponential, uniform and half-normal delays.
  Duration uncertainty() const { return uncertainty_; }

  /// Number of times that the camera's clock wrapped, ran backwards, jumped or stopped. Calls of reset() are not
  /// counted.
  std::uint64_t leaps() const { return leaps_; }

  /// True if the last frames all had the same stamp.
  bool stands_still() const { return still_ >= kStill; }

 private:
  static constexpr std::size_t kWindow = 64;

  // x: camera time since the first stamp, s. y: receipt minus camera time since the first receipt, s.
  struct Sample {
    double x = 0.0;
    double y = 0.0;
  };
  struct Line {
    double slope = 0.0;
    double height = 0.0;  // at x = 0
    double at(double x) const { return height + slope * x; }
  };
  struct Bucket {
    std::int64_t index = 0;
    Sample lowest;
  };

  static constexpr int kStill = 3;  // repeated stamps; fewer may be an image that was sent twice

  void begin(Duration camera_time, Timestamp received);
  void begin_anew(Duration camera_time, Timestamp received);
  bool leapt(const Sample& sample);
  void remember(const Sample& sample);
  Line line_under_samples() const;
  double error_of(const Line& line) const;
  Duration judge(const Sample& newest);

  BoundedVector<Bucket, kWindow> buckets_;  // in order of time
  Line line_;
  bool begun_ = false;
  Duration first_camera_time_{};
  Timestamp first_received_;
  Duration last_camera_time_{};
  double late_since_x_ = -1.0;  // all samples since then are far above the line; negative: the last one is not
  double known_slope_ = 0.0;    // estimate before the last jump
  bool slope_known_ = false;
  int still_ = 0;          // consecutive frames with the stamp of the frame before
  double spread_s_ = 0.0;  // running mean of the height of samples above the line
  Duration uncertainty_{};
  std::uint64_t leaps_ = 0;
};

}  // namespace mocap::cameras
