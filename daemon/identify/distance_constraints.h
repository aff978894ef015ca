#pragma once

#include <span>
#include <vector>

#include "base/archive.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Bounds of the distance between two markers of one body, over all poses.
struct InterMarkerDistance {
  int other = 0;  ///< the other marker
  double min_m = 0.0;
  double max_m = 0.0;
  bool rigid = false;  ///< the distance is constant: `min_m` equals `max_m`

  void archive(Archive& members) { members(min_m, max_m, rigid); }
};

/// Distance constraints between the markers of a body: markers of one bone, and markers of two bones that share a
/// joint. A marker that sits in the joint of its bone is also a marker of the parent.
class DistanceConstraints {
 public:
  explicit DistanceConstraints(const MarkerSet& set);

  std::span<const InterMarkerDistance> of(std::size_t marker) const { return distances_[marker]; }

  /// Takes over fitted offsets. `set` equals the set of the constructor except for its offsets. Allocates nothing.
  void refit(const MarkerSet& set);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(distances_); }

 private:
  std::vector<std::vector<InterMarkerDistance>> distances_;  // by marker
};

}  // namespace mocap::identify
