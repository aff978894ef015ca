#pragma once

#include "model/blob.h"

namespace mocap {

/// Tracks the blobs of one camera in 2D from image to image.
///
/// The camera's thread owns a BlobTracker and makes all calls.
class BlobTracker {
 public:
  virtual ~BlobTracker() = default;

  /// Completes the frame that the camera's thread is building: sets the `track` of each blob, which names nothing if
  /// the track is not confirmed. Frames come in the order of their exposure.
  virtual void track(BlobFrame& frame) = 0;
};

}  // namespace mocap
