#pragma once

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
};

}  // namespace mocap
