#pragma once

#include "Misc/FrameTime.h"

struct FFrameRate {
  FFrameRate() = default;
  FFrameRate(uint32 numerator, uint32 denominator)
      : Numerator(static_cast<int32>(numerator)), Denominator(static_cast<int32>(denominator)) {}
  double AsDecimal() const { return static_cast<double>(Numerator) / Denominator; }
  FFrameTime AsFrameTime(double seconds) const {
    const double frames = seconds * AsDecimal();
    return FFrameTime(FFrameNumber(static_cast<int32>(std::floor(frames))),
                      static_cast<float>(frames - std::floor(frames)));
  }
  int32 Numerator = 60000;
  int32 Denominator = 1001;
};
