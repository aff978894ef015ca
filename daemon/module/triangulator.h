#pragma once

#include "model/sighting.h"

namespace mocap {

/// Triangulates matches.
///
/// One thread makes all calls.
class Triangulator {
 public:
  virtual ~Triangulator() = default;

  /// Returns the 3D position of each match that can be triangulated reliably, in the order of the matches. The result
  /// is borrowed until the next call.
  virtual const Markers& triangulate(const FrameSet& frames, const Matches& matches) = 0;
};

}  // namespace mocap
