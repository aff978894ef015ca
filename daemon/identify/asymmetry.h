#pragma once

#include <Eigen/Core>
#include <vector>

#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// A pair of markers whose asymmetry is smaller than this does not distinguish left from right: two markers that are
/// placed to 10 mm each differ by 14 mm (1 sigma), and so do the legs of a person. The bound is 2.5 sigma.
inline constexpr double kMinAsymmetry_m = 0.035;

/// Offset of a marker from the mirror image of the opposite marker, as seen from the front: to the left and up, m. The
/// difference along x is not used: it is the same for a body that is identified back to front. Both offsets are from
/// the middle of the body or from the joints of opposite bones; x points forward, y to the left of the body.
inline Eigen::Vector3d asymmetry_m(const Eigen::Vector3d& one_m, const Eigen::Vector3d& other_m) {
  return {0.0, one_m.y() + other_m.y(), one_m.z() - other_m.z()};
}

/// The same for two markers of a set, with their offsets in the set.
Eigen::Vector3d asymmetry_m(const MarkerSet& set, const MarkerPair& pair);

/// By bone: index of the bone whose joint is the mirror image in rest pose; the bone itself if it is central; -1: none.
std::vector<int> opposite_bones(const Skeleton& skeleton);

/// The pairs of markers on opposite bones whose names differ in the side only: LThigh and RThigh, BackLeft and
/// BackRight. In the order of the set; the left marker is first in each pair.
std::vector<MarkerPair> opposite_markers(const MarkerSet& set);

/// The opposite markers with an asymmetry of kMinAsymmetry_m or more, with their offsets in the set.
std::vector<MarkerPair> asymmetric_markers(const MarkerSet& set);

/// Returns `set` with the pairs added that are asymmetric on the fitted body. These markers get their fitted offsets,
/// divided by the size of the body; all others keep their offsets. Returns `set` without change if the fit did not
/// start from a rest pose, because the axes of the fitted bones are then unknown.
MarkerSet with_asymmetries(const MarkerSet& set, const bodyfit::FittedSubject& fitted);

}  // namespace mocap::identify
