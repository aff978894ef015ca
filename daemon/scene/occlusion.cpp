#include "scene/occlusion.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace mocap::scene {
namespace {

constexpr Eigen::Index kAxisUp = 2;
constexpr double kSkin_m = 0.005;  // a line of sight nearer to the bone than the marker by this passes through the limb
constexpr double kHeadBall_m = 0.10;  // from the head's joint up to the centre of the skull

// Radii of an adult's limbs, m, by the suffix of the bone's name.
constexpr std::array<std::pair<std::string_view, double>, 9> kRadii{{{"Hips", 0.12},
                                                                     {"Chest", 0.12},
                                                                     {"Neck", 0.05},
                                                                     {"Head", 0.09},
                                                                     {"Collar", 0.04},
                                                                     {"UpArm", 0.045},
                                                                     {"LowArm", 0.035},
                                                                     {"UpLeg", 0.075},
                                                                     {"LowLeg", 0.05}}};
constexpr double kOtherRadius_m = 0.04;

double radius_of_m(std::string_view bone) {
  const auto known = std::ranges::find_if(kRadii, [&](const auto& entry) { return bone.ends_with(entry.first); });
  return known == kRadii.end() ? kOtherRadius_m : known->second;
}

}  // namespace

double segment_distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                          const Eigen::Vector3d& d) {
  const Eigen::Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  const auto share = [](double numerator, double denominator) {
    return denominator > 1e-12 ? std::clamp(numerator / denominator, 0.0, 1.0) : 0.0;
  };
  double s = share(uv * vw - uw * vv, uu * vv - uv * uv);
  double t = vv > 1e-12 ? (uv * s + vw) / vv : 0.0;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = share(uv * t - uw, uu);
  } else if (vv <= 1e-12) {
    s = share(-uw, uu);
  }
  return (w + s * u - t * v).norm();
}

Flesh::Flesh(const MarkerSet& marker_set) {
  const auto& bones = marker_set.skeleton.bones;
  for (const MarkerOnBone& marker : marker_set.markers) bone_of_marker_.push_back(marker.bone);
  for (std::size_t i = 0; i < bones.size(); ++i) {
    parents_.push_back(bones[i].parent);
    const int bone = static_cast<int>(i);
    if (bones[i].parent >= 0) {
      const std::string& parent = bones[static_cast<std::size_t>(bones[i].parent)].name;
      // Capsules across the trunk (to the collars and the hip joints) are thinner than the trunk.
      const bool along_trunk = bones[i].name == "Chest" || bones[i].name == "Neck" || radius_of_m(parent) < 0.1;
      limbs_.push_back({bones[i].parent, bone, along_trunk ? radius_of_m(parent) : 0.07});
    }
    if (bones[i].name == "Head") limbs_.push_back({bone, -1, radius_of_m("Head")});
  }
}

bool Flesh::hides(const ActorState& state, std::size_t marker, const Eigen::Vector3d& eye_m) const {
  if (state.world_from_bone.size() != parents_.size()) return false;
  const Eigen::Vector3d& light_m = state.markers[marker].position.v;
  const int own = bone_of_marker_[marker];
  for (const Limb& limb : limbs_) {
    const auto bone = static_cast<std::size_t>(limb.bone);
    if (limb.bone == own || parents_[bone] == own || parents_[static_cast<std::size_t>(own)] == limb.bone) continue;
    if (is_between(limb, state, light_m, eye_m)) return true;
  }
  return false;
}

bool Flesh::hides(const ActorState& state, const Eigen::Vector3d& light_m, const Eigen::Vector3d& eye_m) const {
  if (state.world_from_bone.size() != parents_.size()) return false;
  return std::ranges::any_of(limbs_, [&](const Limb& limb) { return is_between(limb, state, light_m, eye_m); });
}

bool Flesh::is_between(const Limb& limb, const ActorState& state, const Eigen::Vector3d& light_m,
                       const Eigen::Vector3d& eye_m) const {
  const Pose& pose = state.world_from_bone[static_cast<std::size_t>(limb.bone)];
  const Eigen::Vector3d end_m = limb.child >= 0
                                    ? state.world_from_bone[static_cast<std::size_t>(limb.child)].position
                                    : Eigen::Vector3d(pose * (kHeadBall_m * Eigen::Vector3d::Unit(kAxisUp)));
  const Eigen::Vector3d begin_m = limb.child >= 0 ? pose.position : end_m;
  const double sight_distance_m = segment_distance_m(light_m, eye_m, begin_m, end_m);
  if (sight_distance_m >= limb.radius_m) return false;
  // A marker inside the capsule counts as on the skin: it is hidden only if the line of sight comes nearer to the bone
  // than the marker itself.
  return sight_distance_m < segment_distance_m(light_m, light_m, begin_m, end_m) - kSkin_m;
}

}  // namespace mocap::scene
