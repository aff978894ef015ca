#pragma once

#include <algorithm>

#include "model/skeleton.h"

namespace mocap::kinematics {

/// A range belongs to a hinge if its smaller side is at most this fraction of its larger side. The elbows and knees of
/// config/skeletons have 10 of 155 degrees (0.065). Chosen by hand; not yet measured.
inline constexpr double kMaxReverseRangeFraction = 0.15;

/// A hinge rotates about its minor axis by less than this in either direction. The elbows and knees of config/skeletons
/// have 10 or 15 degrees (0.26 rad). Chosen by hand; not yet measured.
inline constexpr double kMaxMinorRange_rad = 0.3;

/// A rotation axis of a hinge counts as observed if its observed fraction (1 - posterior variance / prior variance) is
/// above this. Chosen by hand; not yet measured.
inline constexpr double kMinObservedFraction = 0.8;

/// How far an axis rotates from the rest pose in each direction, rad, both at least 0.
struct AxisReach {
  double positive_rad = 0.0;
  double negative_rad = 0.0;

  double larger_rad() const { return std::max(positive_rad, negative_rad); }
  double smaller_rad() const { return std::min(positive_rad, negative_rad); }
};

inline AxisReach reach_of(const AngleRange& range) {
  return {std::max(0.0, range.max_rad), std::max(0.0, -range.min_rad)};
}

/// Whether a joint axis bends in one direction only, as an elbow or a knee does. True for an axis without any range,
/// too.
inline bool bends_one_way(const AxisReach& reach) {
  return reach.smaller_rad() <= kMaxReverseRangeFraction * reach.larger_rad();
}

}  // namespace mocap::kinematics
