#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/blob.h"
#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::bench {

/// Blobs to points as one writes it with OpenCV: undistortPoints; computeCorrespondEpilines from each camera to its
/// neighbour on the ring; of the blobs within 2 px of a line the nearest; triangulatePoints of the pairs.
///
/// It knows no expected markers, asks as many pairs as there are cameras (of all there may be), and does not say which
/// pairs are one marker: each of that would cost more.
class FuseReference {
 public:
  explicit FuseReference(const Rig& rig);
  ~FuseReference();

  /// The points of one set; borrowed until the next call.
  std::span<const WorldPoint> step(std::span<const std::unique_ptr<BlobFrame>> frames);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mocap::bench
