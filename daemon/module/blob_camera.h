#pragma once

#include "model/blob.h"
#include "module/camera.h"

namespace mocap {

/// A camera whose blobs were detected and tracked in 2D elsewhere: by a node, or before a take was recorded. Its images
/// have the right size and no pixels.
class BlobCamera : public Camera {
 public:
  /// The blobs of the last image that next() returned, with their 2D tracks.
  virtual const Blobs& blobs() const = 0;

  bool has_pixels() const override { return false; }
};

}  // namespace mocap
