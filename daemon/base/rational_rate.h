#pragma once

#include <cstdint>

namespace mocap {

/// A frame rate as a fraction, so that 29.97 Hz (30000/1001) and long takes have no rounding error.
struct Rate {
  std::int64_t numerator = 120;
  std::int64_t denominator = 1;

  double hz() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
  /// Time of frame `frame` after frame 0, s.
  double time_s(std::int64_t frame) const {
    return static_cast<double>(frame) * static_cast<double>(denominator) / static_cast<double>(numerator);
  }
};

}  // namespace mocap
