#pragma once

#include <algorithm>

#include "base/time.h"

namespace mocap::web {

/// A rate limit: `rate_hz` events a second on average, and up to `burst` at once.
class TokenBucket {
 public:
  TokenBucket(double rate_hz, double burst) : rate_hz_(rate_hz), burst_(burst), tokens_(burst) {}

  /// Whether one more event is within the limit at `now`. The times of calls must not decrease.
  bool take(Timestamp now) {
    if (last_ != Timestamp{}) tokens_ = std::min(burst_, tokens_ + rate_hz_ * to_s(now - last_));
    last_ = now;
    if (tokens_ < 1.0) return false;
    tokens_ -= 1.0;
    return true;
  }

 private:
  double rate_hz_;
  double burst_;
  double tokens_;
  Timestamp last_;
};

}  // namespace mocap::web
