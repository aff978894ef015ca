#include "identify/asymmetry.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace mocap::identify {
namespace {

// Joints of a skeleton file are mirror images to 1 mm, those of a fitted body less exactly.
constexpr double kSameJoint_m = 0.02;
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kSides{
    {{"Left", "Right"}, {"left", "right"}, {"L", "R"}}};

std::optional<std::size_t> marker_named(const MarkerSet& set, std::string_view name) {
  const auto found = std::ranges::find(set.markers, name, &MarkerOnBone::name);
  if (found == set.markers.end()) return std::nullopt;
  return static_cast<std::size_t>(found - set.markers.begin());
}

// Index of the marker whose name is `name` with one word for the left side replaced by that for the right side.
std::optional<std::size_t> named_opposite(const MarkerSet& set, const std::string& name) {
  for (const auto& [left, right] : kSides) {
    for (std::size_t at = name.find(left); at != std::string::npos; at = name.find(left, at + 1)) {
      const auto other = marker_named(set, std::string(name).replace(at, left.size(), right));
      if (other) return other;
    }
  }
  return std::nullopt;
}

}  // namespace

Eigen::Vector3d asymmetry_m(const MarkerSet& set, const MarkerPair& pair) {
  return asymmetry_m(set.markers[pair.one].offset_m, set.markers[pair.other].offset_m);
}

std::vector<int> opposite_bones(const Skeleton& skeleton) {
  std::vector<Eigen::Vector3d> joints;
  for (const Bone& bone : skeleton.bones) {
    const bool root = bone.parent < 0;
    joints.push_back(root ? Eigen::Vector3d::Zero()
                          : Eigen::Vector3d(joints[static_cast<std::size_t>(bone.parent)] + bone.rest_offset_m));
  }
  std::vector<int> opposite;
  for (const Eigen::Vector3d& joint : joints) {
    const Eigen::Vector3d image(joint.x(), -joint.y(), joint.z());
    const auto off_m = [&](const Eigen::Vector3d& other) { return (other - image).norm(); };
    const auto nearest = std::ranges::min_element(joints, {}, off_m);
    opposite.push_back(off_m(*nearest) < kSameJoint_m ? static_cast<int>(nearest - joints.begin()) : -1);
  }
  return opposite;
}

std::vector<MarkerPair> opposite_markers(const MarkerSet& set) {
  const std::vector<int> opposite = opposite_bones(set.skeleton);
  std::vector<MarkerPair> pairs;
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    const auto other = named_opposite(set, set.markers[m].name);
    if (other && opposite[static_cast<std::size_t>(set.markers[m].bone)] == set.markers[*other].bone)
      pairs.push_back({m, *other});
  }
  return pairs;
}

std::vector<MarkerPair> asymmetric_markers(const MarkerSet& set) {
  std::vector<MarkerPair> pairs = opposite_markers(set);
  std::erase_if(pairs, [&](const MarkerPair& pair) { return asymmetry_m(set, pair).norm() < kMinAsymmetry_m; });
  return pairs;
}

MarkerSet with_asymmetries(const MarkerSet& set, const bodyfit::FittedSubject& fitted) {
  MarkerSet fitted_set = set;
  if (!fitted.from_rest) return fitted_set;
  const auto fitted_offset_m = [&](std::size_t m) {
    return Eigen::Vector3d(fitted.marker_set.markers[m].offset_m / fitted.size);
  };
  for (const MarkerPair& pair : opposite_markers(set)) {
    const Eigen::Vector3d one_m = fitted_offset_m(pair.one), other_m = fitted_offset_m(pair.other);
    if (asymmetry_m(one_m, other_m).norm() < kMinAsymmetry_m) continue;
    fitted_set.markers[pair.one].offset_m = one_m;
    fitted_set.markers[pair.other].offset_m = other_m;
    fitted_set.asymmetric.push_back(pair);
  }
  return fitted_set;
}

}  // namespace mocap::identify
