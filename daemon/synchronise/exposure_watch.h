#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"

namespace mocap::synchronise {

/// Phase of one camera's exposures relative to the other cameras.
struct CameraTiming {
  bool is_known = false;     ///< enough frames were observed
  bool synchronised = true;  ///< exposes together with the largest group of cameras, without drift
  double rate_hz = 0.0;
  Duration offset{0};       ///< from the group's mean, within half a period; positive: later
  double drift_us_s = 0.0;  ///< rate of change of the offset
  Duration jitter{0};       ///< standard deviation of the offset about its linear trend
};

/// Distinguishes free-running cameras from synchronised cameras by the time stamps of their frames. The phase of each
/// frame is measured in the period of one reference camera; a line is fitted to each camera's phase over the last
/// seconds (exponentially weighted least squares); the largest group of cameras whose lines agree is synchronised. The
/// choice of the reference camera does not change the result.
///
/// Thread: one. Reads no clock. Never allocates after construction.
class ExposureWatch {
 public:
  /// Two cameras expose together if their offsets differ by at most `window`.
  ExposureWatch(Duration window, std::size_t camera_count);

  /// Adds the exposure time of one frame. Frames of one camera arrive in the order of exposure.
  void see(CameraId camera, Timestamp exposed_at);

  /// Discards the observations of a camera that was started again.
  void forget(CameraId camera);

  /// Finds the largest group. The cost is quadratic in the number of cameras: call about once a second.
  void assess();

  /// The result of the last `assess`.
  const CameraTiming& timing(CameraId camera) const { return timings_[camera.value]; }

 private:
  static constexpr std::size_t kFirstFrames =
      15;  // frames from which the first estimate of the period is the median step

  // A line through offsets over time, by least squares with exponentially decaying weights.
  struct Line {
    std::uint64_t count = 0;
    double weight = 0.0;
    double mean_s = 0.0;  // weighted mean of the times
    double mean_offset_s = 0.0;
    double tt = 0.0, to = 0.0, oo = 0.0;  // weighted sums of squares and products about the means
    double last_s = 0.0;
    double last_offset_s = 0.0;

    void add(double at_s, double offset_s);
    double drift() const { return tt > 0.0 ? to / tt : 0.0; }
    double at(double time_s) const { return mean_offset_s + drift() * (time_s - mean_s); }
    double jitter_s() const;
    double drift_sigma() const;
  };
  struct ObservedCamera {
    std::optional<Timestamp> last;
    double period_s = 0.0;
    std::array<double, kFirstFrames> first_steps_s{};
    std::uint64_t frames = 0;
    Line line;
  };

  double seconds(Timestamp at) const { return to_s(at - *origin_); }
  void follow_period(ObservedCamera& state, Timestamp exposed_at);
  void set_reference_clock(std::uint32_t camera);
  bool is_known(const ObservedCamera& state) const;
  double offset_difference_s(const ObservedCamera& a, const ObservedCamera& b) const;
  bool agree(const ObservedCamera& a, const ObservedCamera& b) const;
  std::uint32_t centre_of_largest_group() const;

  double window_s_;
  std::vector<ObservedCamera> cameras_;
  std::vector<CameraTiming> timings_;
  std::optional<Timestamp> origin_;
  std::optional<std::uint32_t> clock_;  // the reference camera, in whose period phases are measured
  Timestamp now_;                       // the latest exposure of any camera
};

}  // namespace mocap::synchronise
