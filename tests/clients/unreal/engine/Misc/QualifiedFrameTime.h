#pragma once

#include "Misc/FrameRate.h"
#include "Misc/Timecode.h"

struct FQualifiedFrameTime {
  FQualifiedFrameTime() : Rate(24, 1) {}
  FQualifiedFrameTime(const FFrameTime& time, const FFrameRate& rate) : Time(time), Rate(rate) {}
  FQualifiedFrameTime(const FTimecode& timecode, const FFrameRate& rate)
      : Time(timecode.ToFrameNumber(rate)), Rate(rate) {}
  FFrameTime Time;
  FFrameRate Rate;
};
