#pragma once

#include "model/sighting.h"

namespace mocap {

/// Gathers the views of one marker across cameras.
class Matcher {
 public:
  virtual ~Matcher() = default;

  /// The expected markers first, the rest by epipolar geometry. A blob belongs to one match at most. The result is
  /// borrowed until the next call.
  virtual const Matches& match(const FrameSet& frames, const Expected& expected) = 0;
};

}  // namespace mocap
