#pragma once

#include "base/archive.h"
#include "model/predictions.h"
#include "model/sighting.h"

namespace mocap {

/// Associates the blobs of many views with markers.
///
/// One thread makes all calls.
class Matcher {
 public:
  virtual ~Matcher() = default;

  /// Associates the blobs of one set, first with the predicted markers, then with each other. A blob belongs to at most
  /// one match, unless it is marked as shared. `predicted.views` has the views of `frames` or is empty. The result is
  /// borrowed until the next call.
  virtual const Matches& match(const FrameSet& frames, const Predictions& predicted) = 0;

  /// Writes the belief, or takes it over from a matcher that was built with the same settings. Call between two sets. A
  /// matcher without memory does nothing.
  virtual void archive(Archive& /*members*/) {}
};

}  // namespace mocap
