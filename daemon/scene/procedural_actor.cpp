#include "scene/procedural_actor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "base/expects.h"
#include "kinematics/kinematic_tree.h"
#include "scene/person.h"

namespace mocap::scene {
namespace {

constexpr double kAnkleHeight_m = 0.08;  // of the foot's joint above the floor
constexpr double kFloatHeight_m = 1.0;
constexpr double kSoftness_1_m = 100.0;  // of soft_min: largest difference from the minimum 7 mm (log 2 / 100)

// A smooth minimum of two heights; equal to their value if they are equal.
double soft_min(double a, double b) {
  const double low = std::min(a, b);
  return low -
         std::log(0.5 * (std::exp(-kSoftness_1_m * (a - low)) + std::exp(-kSoftness_1_m * (b - low)))) / kSoftness_1_m;
}

class ProceduralActor final : public Actor {
 public:
  ProceduralActor(MarkerSet marker_set, Program program)
      : marker_set_(std::move(marker_set)), program_(std::move(program)) {
    const auto& bones = marker_set_.skeleton.bones;
    MOCAP_EXPECTS(!bones.empty() && bones.size() <= kMaxBones && marker_set_.markers.size() <= kMaxLabels);
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      const auto bone = std::ranges::find(bones, kJointNames[joint], &Bone::name);
      if (bone != bones.end()) bone_of_[joint] = static_cast<std::size_t>(bone - bones.begin());
    }
  }

  const MarkerSet& marker_set() const override { return marker_set_; }

  void at(double t_s, ActorState& into) const override {
    const Posture posture = posture_at(program_, t_s);
    std::array<Eigen::Quaterniond, kMaxBones> rotations;
    rotations.fill(Eigen::Quaterniond::Identity());
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      if (bone_of_[joint]) rotations[*bone_of_[joint]] = posture.rotations[joint];
    }
    rotations[0] = Eigen::AngleAxisd(posture.heading_rad, Eigen::Vector3d::UnitZ()) * rotations[0];

    const Skeleton& skeleton = marker_set_.skeleton;
    into.world_from_bone.resize(skeleton.bones.size());
    const Eigen::Vector3d place_m(posture.place_m.x(), posture.place_m.y(), 0.0);
    kinematics::compute_forward_kinematics(skeleton, place_m, std::span(rotations).first(skeleton.bones.size()),
                                           into.world_from_bone);
    const double up_m = posture.lift_m + height_of_root_m(into);
    for (Pose& pose : into.world_from_bone) pose.position.z() += up_m;

    into.ghosts.clear();
    into.markers.clear();
    for (const MarkerOnBone& marker : marker_set_.markers) {
      const Pose& world_from_bone = into.world_from_bone[static_cast<std::size_t>(marker.bone)];
      into.markers.push_back({kinematics::marker_position(marker, world_from_bone), true});
    }
  }

 private:
  // Height of the root above the floor; `state` has the root at height 0.
  double height_of_root_m(const ActorState& state) const {
    const auto left = bone_of_[static_cast<std::size_t>(Joint::LeftFoot)];
    const auto right = bone_of_[static_cast<std::size_t>(Joint::RightFoot)];
    if (!left || !right) return kFloatHeight_m;
    const double left_m = state.world_from_bone[*left].position.z();
    const double right_m = state.world_from_bone[*right].position.z();
    return kAnkleHeight_m - soft_min(left_m, right_m);
  }

  MarkerSet marker_set_;
  Program program_;
  std::array<std::optional<std::size_t>, kJoints> bone_of_;
};

}  // namespace

std::unique_ptr<Actor> make_procedural_actor(MarkerSet marker_set, Program program) {
  return std::make_unique<ProceduralActor>(std::move(marker_set), std::move(program));
}

}  // namespace mocap::scene
