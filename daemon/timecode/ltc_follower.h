#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "timecode/ltc_decoder.h"
#include "timecode/timecode_settings.h"

namespace mocap::timecode {

/// Follows LTC in sound and says why there is no timecode. Reads no clock.
class LtcFollower {
 public:
  /// `name`: of the source of the sound, for the operator: "device 'hw:1'". `exposures_per_s`: of the cameras, 0:
  /// unknown.
  LtcFollower(const TimecodeSettings& settings, std::string name, double exposures_per_s);

  void add(const AudioBlock& block);

  /// The source cannot be read; no block follows for now.
  void fail(const Error& error) { failure_ = error.message; }

  TimecodeHealth state(Timestamp now) const;

 private:
  std::string cause(Timestamp now) const;
  std::string cause_in_signal() const;

  TimecodeSettings settings_;
  std::string name_;
  double exposures_per_s_;
  LtcDecoder decoder_;
  FlyWheel wheel_;
  std::string failure_;  // empty: the source delivers
  std::optional<Timestamp> last_block_at_;
  std::optional<Timestamp> heard_at_;  // the last decoded frame
  LtcVerdict heard_ = LtcVerdict::Disagrees;
  double peak_ = 0.0;  // of the samples, 0 to 1, over about the last second
};

}  // namespace mocap::timecode
