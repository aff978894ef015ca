#pragma once

#include "model/sighting.h"

namespace mocap {

/// Finds where in the volume each matched marker is.
class Triangulator {
 public:
  virtual ~Triangulator() = default;

  /// Matches that give no trustworthy point give none. The result is borrowed until the next call.
  virtual const Markers& triangulate(const FrameSet& frames, const Matches& matches) = 0;
};

}  // namespace mocap
