#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"

namespace mocap::synchronise {

/// How a camera's exposures lie against those of the others.
struct CameraTiming {
  bool is_known = false;     ///< seen long enough
  bool synchronised = true;  ///< exposes with the largest group of cameras, and keeps doing so
  double rate_hz = 0.0;
  Duration offset{0};       ///< after the group's mean, within half a period either way
  double drift_us_s = 0.0;  ///< how the offset grows
  Duration jitter{0};       ///< standard deviation of the offset about its drift
};

/// Tells free-running cameras from synchronised ones by the time stamps of their frames: each frame's phase in the
/// period of one camera that serves as clock, its straight line over the last seconds, and the largest group of cameras
/// whose lines agree. Which camera is the clock does not matter.
///
/// Reads no clock. Nothing allocates after construction. One thread at a time.
class ExposureWatch {
 public:
  /// Cameras whose offsets differ by `window` or less expose together.
  ExposureWatch(Duration window, std::size_t camera_count);

  /// A frame of a camera. Those of one camera come in the order of their exposure.
  void see(CameraId camera, Timestamp exposed_at);

  /// The camera began anew.
  void forget(CameraId camera);

  /// Finds the group. Costs cameras squared: about once a second.
  void assess();

  /// As of the last `assess`.
  const CameraTiming& timing(CameraId camera) const { return timings_[camera.value]; }

 private:
  static constexpr std::size_t kFirstFrames = 15;  // that tell the period at first

  // A straight line through offsets over time, what is older counting less and less (weighted least squares).
  struct Line {
    std::uint64_t count = 0;
    double weight = 0.0;
    double mean_s = 0.0;  // of the times
    double mean_offset_s = 0.0;
    double tt = 0.0, to = 0.0, oo = 0.0;  // sums of squares and products about the means
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
  std::optional<std::uint32_t> clock_;  // the camera in whose period phases are told
  Timestamp now_;                       // the latest exposure
};

}  // namespace mocap::synchronise
