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
  /// Takes in one frame and tells the host's time of its stamp, plus the least delay. Starts anew when the camera's
  /// clock stands still, runs back or leaps; a clock that stands still gives the time of receipt. Never later than
  /// `received`.
  Timestamp map(Duration camera_time, Timestamp received);

  /// Forgets everything: after the camera was started again.
  void reset();

  /// Seconds that the host's clock gains on the camera's in a second, as now estimated; within 500 ppm.
  double drift() const { return line_.slope; }

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

  void begin(Duration camera_time, Timestamp received);
  bool leapt(const Sample& sample);
  void remember(const Sample& sample);
  Line line_under_samples() const;

  BoundedVector<Bucket, kWindow> buckets_;  // in the order of time
  Line line_;
  bool begun_ = false;
  Duration first_camera_time_{};
  Timestamp first_received_;
  Duration last_camera_time_{};
  double late_since_x_ = -1.0;  // since when every sample lies far above the line; negative: the last did not
};

}  // namespace mocap::cameras
