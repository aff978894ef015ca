#pragma once

#include <cstdint>
#include <string>

#include "base/time.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/clock/clock_mapping.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// What came with one image about its instant.
struct ImageInstants {
  Duration stamp{};         ///< by the camera's clock
  Duration exposure{};      ///< how long it was
  bool stamp_tells_begin;   ///< of the exposure, whatever the settings say
  Timestamp first_byte;     ///< here
  Timestamp received;       ///< whole
  Duration utc_minus_host;  ///< now
};

/// Tells the middle of each exposure on the host's clock, as AravisSettings::clock says: by the camera's own UTC while
/// that can be believed, else by the receipts. The mapping from the receipts learns all the time, and how far it is off
/// the camera's UTC, so that a camera which loses its master goes on without a jump. Never allocates, but for a warning
/// once. Deterministic. One thread.
class ExposureClock {
 public:
  /// `name` is the camera's, for the log.
  ExposureClock(std::string name, const AravisSettings& settings);

  /// Forgets what was learnt of the clock: after the camera was started again.
  void reset();

  /// Later than that of the image before. `synchronised`: whether the camera says that it keeps PTP time, or was never
  /// asked to.
  Timestamp middle_of(const ImageInstants& image, bool synchronised);

  /// Of the last exposure.
  ClockSource source() const { return source_; }
  /// Standard deviation of the last exposure; 0 by the camera's own UTC.
  Duration uncertainty() const;
  std::uint64_t leaps() const { return mapping_.leaps(); }

 private:
  bool believes(Duration ahead, Duration exposure);

  std::string name_;
  bool wants_utc_;
  Duration delivery_;
  double into_exposure_;  // where the stamp lies, in exposures after the begin
  ClockMapping mapping_;
  Duration mapped_late_{};  // what the mapping's middles lie after the camera's own, by experience
  bool late_known_ = false;
  bool doubted_ = false;
  ClockSource source_ = ClockSource::Unknown;
  Timestamp last_;
};

}  // namespace mocap::cameras
