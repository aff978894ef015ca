#pragma once

#include <memory>
#include <span>

#include "model/points.h"
#include "model/skeleton.h"

namespace mocap::bench {

/// Reference for the pose of a body from its markers, with Ceres: one rotation vector for each bone and the root
/// position, residuals of all markers, automatic derivatives, dense QR, initial value from the previous set. Without
/// joint limits, outliers and labelling.
class SolveReference {
 public:
  explicit SolveReference(const MarkerSet& marker_set);
  SolveReference(SolveReference&& other) noexcept;
  ~SolveReference();

  /// Solves the pose. `markers` must contain all markers of the marker set. Returns the rms of the residuals, m.
  double solve(std::span<const WorldPoint> markers);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace mocap::bench
