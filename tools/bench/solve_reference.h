#pragma once

#include <memory>
#include <span>

#include "model/points.h"
#include "model/skeleton.h"

namespace mocap::bench {

/// A body's pose from its markers as one writes it with Ceres: a rotation vector a bone and the root's place, residuals
/// of all markers, derivatives by autodiff, dense QR, from the pose of the set before. It knows no limits, no outliers
/// and no names.
class SolveReference {
 public:
  explicit SolveReference(const MarkerSet& worn);
  SolveReference(SolveReference&& other) noexcept;
  ~SolveReference();

  /// The rms of the markers from where the pose has them, m. All markers of the set are there.
  double solve(std::span<const WorldPoint> markers);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mocap::bench
