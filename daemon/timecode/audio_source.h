#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"
#include "base/time.h"

namespace mocap::timecode {

/// Successive samples of one channel.
struct AudioBlock {
  std::span<const std::int16_t> samples;
  Timestamp first_at;  ///< of the first sample, on the host's clock
  double rate_hz = 0.0;
};

/// A source of sound. One thread owns it and makes all calls.
class AudioSource {
 public:
  virtual ~AudioSource() = default;

  /// Waits about `patience` for the next samples, which are valid until the next call. Opens the source if it is not
  /// open, again after a failure. Fails with Timeout, with EndOfStream after the last sample, and with another code,
  /// after a wait of `patience`, if the source cannot be read now.
  virtual Result<AudioBlock> next(Duration patience) = 0;

  /// "device 'hw:1'", for messages.
  virtual const std::string& name() const = 0;
};

}  // namespace mocap::timecode
