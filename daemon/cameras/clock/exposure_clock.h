#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "base/time.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/clock/clock_mapping.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// TAI - UTC since 2017; no leap second is planned.
inline constexpr Duration kTaiMinusUtc = std::chrono::seconds(37);

/// Times that belong to one image.
struct ImageInstants {
  Duration stamp{};         ///< on the camera's clock
  Duration exposure{};      ///< length of the exposure
  bool stamp_tells_begin;   ///< stamp = begin of the exposure; overrides the settings
  Timestamp first_byte;     ///< arrival of the first byte
  Timestamp received;       ///< arrival of the last byte
  Duration utc_minus_host;  ///< current difference
};

/// Computes the middle of each exposure on the host's clock, from the camera's UTC while it is plausible, otherwise by
/// ClockMapping, as AravisSettings::clock selects. The mapping and its offset from the camera's UTC are estimated all
/// the time, so that a camera that loses its PTP master causes no step (decisions/0010). Never allocates, except for
/// one warning. Deterministic. One thread.
class ExposureClock {
 public:
  /// `name` is the camera's name in the log.
  ExposureClock(std::string name, const AravisSettings& settings);

  /// Forgets the mapping. Call this when the camera was started again.
  void reset();

  /// Returns the middle of the exposure, later than that of the image before. `synchronised`: the camera keeps PTP
  /// time, or PTP is not used.
  Timestamp middle_of(const ImageInstants& image, bool synchronised);

  /// Origin of the last result.
  ClockSource source() const { return source_; }
  /// Standard deviation of the last result; 0 if it comes from the camera's UTC.
  Duration uncertainty() const;
  std::uint64_t leaps() const { return mapping_.leaps(); }

 private:
  bool believes(Duration ahead, Duration exposure);

  std::string name_;
  bool wants_utc_;
  Duration delivery_;
  double into_exposure_;  // position of the stamp, in lengths of the exposure after its begin
  ClockMapping mapping_;
  Duration mapped_late_{};  // running mean of mapped time minus the camera's UTC
  bool late_known_ = false;
  bool warned_ = false;
  ClockSource source_ = ClockSource::Unknown;
  Timestamp last_;
};

}  // namespace mocap::cameras
