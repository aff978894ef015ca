#pragma once

#include "base/archive.h"
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

  /// Writes the belief, or takes it over from a triangulator that was built with the same settings. Call between two
  /// sets. A triangulator without memory does nothing.
  virtual void archive(Archive& /*members*/) {}
};

}  // namespace mocap
