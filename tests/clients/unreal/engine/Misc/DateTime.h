#pragma once

#include <chrono>

#include "CoreMinimal.h"

struct FTimespan {
  double GetTotalMinutes() const { return Minutes; }
  double Minutes;
};
// The local time of the tests is 2 hours ahead of UTC.
struct FDateTime {
  static FDateTime Now() { return {Minutes() + 120.0}; }
  static FDateTime UtcNow() { return {Minutes()}; }
  FTimespan operator-(const FDateTime& other) const { return {Minutes_ - other.Minutes_}; }

  static double Minutes() {
    return std::chrono::duration<double, std::ratio<60>>(std::chrono::system_clock::now().time_since_epoch()).count();
  }
  double Minutes_;
};
