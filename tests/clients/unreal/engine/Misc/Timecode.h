#pragma once

#include "Misc/FrameRate.h"

struct FTimecode {
  FTimecode(int32 hours, int32 minutes, int32 seconds, int32 frames, bool drop_frame)
      : Hours(hours), Minutes(minutes), Seconds(seconds), Frames(frames), bDropFrameFormat(drop_frame) {}
  // SMPTE ST 12-1: with drop-frame counting, the first two numbers of each minute but the tenth are skipped.
  FFrameNumber ToFrameNumber(const FFrameRate& rate) const {
    const int32 counted = static_cast<int32>(std::ceil(rate.AsDecimal()));
    const int32 minutes = Hours * 60 + Minutes;
    const int32 skipped = bDropFrameFormat ? counted / 15 * (minutes - minutes / 10) : 0;
    return (minutes * 60 + Seconds) * counted + Frames - skipped;
  }
  int32 Hours, Minutes, Seconds, Frames;
  bool bDropFrameFormat;
};
