#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/blob.h"
#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::bench {

/// Reference from blobs to points with OpenCV: undistortPoints; computeCorrespondEpilines from each camera to its
/// neighbour on the ring; the nearest blob within 2 px of a line; triangulatePoints of the pairs. The reference does
/// less work than the daemon: it uses no predictions, tests only neighbouring cameras, and does not join pairs of the
/// same marker.
class FuseReference {
 public:
  explicit FuseReference(const Rig& rig);
  ~FuseReference();

  /// The points of one set. Valid until the next call.
  std::span<const WorldPoint> step(std::span<const std::unique_ptr<BlobFrame>> frames);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mocap::bench
