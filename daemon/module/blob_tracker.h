#pragma once

#include "model/blob.h"

namespace mocap {

/// Follows the blobs of one camera from image to image, in 2D.
class BlobTracker {
 public:
  virtual ~BlobTracker() = default;

  /// Writes each blob's `track` into it. Frames come in the order of their exposure.
  virtual void track(BlobFrame& frame) = 0;
};

}  // namespace mocap
