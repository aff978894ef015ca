#pragma once

#include <memory>
#include <span>
#include <vector>

#include "timecode/audio_source.h"
#include "timecode/fly_wheel.h"

namespace mocap::timecode {

/// Finds the LTC frames in sound (SMPTE ST 12-1, bi-phase mark code), by libltc. A frame is known only when it has
/// ended, but has the time of its start. Accepts any samples.
class LtcDecoder {
 public:
  /// `frames_per_second`: nominal; the decoder follows other rates and speeds.
  explicit LtcDecoder(double frames_per_second);
  ~LtcDecoder();
  LtcDecoder(const LtcDecoder&) = delete;
  LtcDecoder& operator=(const LtcDecoder&) = delete;

  /// The frames that end in this block; valid until the next call. Blocks follow each other without gap, or with a gap
  /// in which a frame is lost.
  std::span<const LtcFrame> decode(const AudioBlock& block);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::timecode
