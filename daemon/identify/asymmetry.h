#pragma once

#include <Eigen/Core>
#include <vector>

#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Markers that are nearer than this to being mirror images of each other tell no sides: two that are placed to 10 mm
/// each differ by 14 mm by chance, and so do people's legs.
inline constexpr double kMinAsymmetry_m = 0.035;

/// How a marker sits against the mirror image of its opposite as seen from the front, m: to the left and up. How far
/// they are to the fore does not count, as a body that is read back to front has that, too. Both offsets are from the
/// body's middle or from the joints of opposite bones, in axes of which x points forward and y to the body's left.
inline Eigen::Vector3d asymmetry_m(const Eigen::Vector3d& one_m, const Eigen::Vector3d& other_m) {
  return {0.0, one_m.y() + other_m.y(), one_m.z() - other_m.z()};
}

/// Likewise of two markers of a set, where they sit in it.
Eigen::Vector3d asymmetry_m(const MarkerSet& set, const MarkerPair& pair);

/// By bone: the one whose joint is its mirror image in rest pose, itself in the middle, -1: there is none.
std::vector<int> opposite_bones(const Skeleton& skeleton);

/// The markers on opposite bones whose names differ in their side only: LThigh and RThigh, BackLeft and BackRight. In
/// the order of the set, the left one first.
std::vector<MarkerPair> opposite_markers(const MarkerSet& set);

/// Those of them that are off their mirror images by kMinAsymmetry_m or more, where they sit in the set.
std::vector<MarkerPair> asymmetric_markers(const MarkerSet& set);

/// A body's set with the pairs that its fit shows to be asymmetric; these sit in it as they do on the body, the others
/// where they are. The set as it is where no rest pose told how the fitted bones lie.
MarkerSet with_asymmetries(const MarkerSet& set, const bodyfit::FittedSubject& fitted);

}  // namespace mocap::identify
