#pragma once

#include <span>
#include <vector>

#include "model/skeleton.h"

namespace mocap::identify {

/// How far apart two markers of one body may be, whatever its pose.
struct InterMarkerDistance {
  int other = 0;       ///< marker at the other end
  double min_m = 0.0;  ///< shortest distance that the joint between them allows
  double max_m = 0.0;  ///< longest
  bool rigid = false;  ///< they move as one: least is most
};

/// The distances that a body keeps: of markers on one bone, and of markers on two bones that share a joint. A marker
/// that sits in its bone's joint counts as one of the parent's, too.
class DistanceConstraints {
 public:
  explicit DistanceConstraints(const MarkerSet& set);

  std::span<const InterMarkerDistance> of(std::size_t marker) const { return distances_[marker]; }

  /// New distances after a fit; `set` is the one of the constructor but for its offsets. Allocates nothing.
  void refit(const MarkerSet& set);

 private:
  std::vector<std::vector<InterMarkerDistance>> distances_;  // by marker
};

}  // namespace mocap::identify
