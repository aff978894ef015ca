#pragma once

#include "CoreMinimal.h"

struct FFrameNumber {
  FFrameNumber() = default;
  FFrameNumber(int32 value) : Value(value) {}
  friend bool operator!=(FFrameNumber left, FFrameNumber right) { return left.Value != right.Value; }
  int32 Value = 0;
};
struct FFrameTime {
  FFrameTime() = default;
  explicit FFrameTime(FFrameNumber number) : FrameNumber(number) {}
  FFrameTime(FFrameNumber number, float sub_frame) : FrameNumber(number), SubFrame_(sub_frame) {}
  float GetSubFrame() const { return SubFrame_; }
  FFrameNumber FrameNumber;
  float SubFrame_ = 0.0F;
};
