#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/bounded_vector.h"
#include "base/time.h"

namespace mocap::cameras {

/// Tells the host's time of what a camera stamped with its own clock.
///
/// A frame is here some time after its stamp: a fixed least delay, and whatever the way added that time. The way only
/// adds, so the truth lies under all samples (camera time, receipt minus camera time): the line sought is the edge of
/// their lower convex hull that spans the middle of the window. It is the best line under all samples for delays of
/// any one-sided law, and the most likely one for exponential delays. What stays unknown is the fixed least delay;
/// the caller knows it, or lives with it.
///
/// The window's memory is bounded: of each half second the one sample nearest to the line is kept, for 32 s. Never
/// allocates; some hundred nanoseconds a frame. Deterministic. One thread.
///
/// Source: Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements" (INFOCOM
/// 1999); the hull is Andrew's monotone chain.
class ClockMapping {
 public:
  /// Takes in one frame and tells the host's time of its stamp, plus the least delay. When the camera's clock wraps,
  /// runs back or leaps, the offset is learnt anew and the drift is kept: a crystal does not change with its counter. A
  /// clock that stands still gives the time of receipt. Never later than `received`.
  Timestamp map(Duration camera_time, Timestamp received);

  /// Forgets everything: after the camera was started again.
  void reset();

  /// Seconds that the host's clock gains on the camera's in a second, as now estimated; within 500 ppm.
  double drift() const { return line_.slope; }

  /// Standard deviation of the last mapped time about the truth plus the least delay, as the samples tell it: 1
  /// to 2 times the error that is there, for delays of an exponential, uniform or half-normal law.
  Duration uncertainty() const { return uncertainty_; }

  /// How often the camera's clock wrapped, ran back, leapt or began to stand still; `reset` does not count.
  std::uint64_t leaps() const { return leaps_; }

  /// Whether the last frames all bore the same stamp.
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

  static constexpr int kStill = 3;  // frames of one stamp: an image that was sent twice is no clock that stands still

  void begin(Duration camera_time, Timestamp received);
  void begin_anew(Duration camera_time, Timestamp received);
  bool leapt(const Sample& sample);
  void remember(const Sample& sample);
  Line line_under_samples() const;
  double error_of(const Line& line) const;
  Duration judge(const Sample& newest);

  BoundedVector<Bucket, kWindow> buckets_;  // in the order of time
  Line line_;
  bool begun_ = false;
  Duration first_camera_time_{};
  Timestamp first_received_;
  Duration last_camera_time_{};
  double late_since_x_ = -1.0;  // since when every sample lies far above the line; negative: the last did not
  double known_slope_ = 0.0;    // from before a leap
  bool slope_known_ = false;
  int still_ = 0;          // frames since that bore the stamp of the one before
  double spread_s_ = 0.0;  // mean height of the samples over the line
  Duration uncertainty_{};
  std::uint64_t leaps_ = 0;
};

}  // namespace mocap::cameras
