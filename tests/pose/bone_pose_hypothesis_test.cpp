#include "pose/bone_pose_hypothesis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace bone_pose_hypothesis_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using kinematics::from_rotation_vector;

constexpr double kRounding = 1e-9;  // rad and rad^2

constexpr AngleRange kFree{};

// A root, an upper bone without a range, and a hinge that bends about x from 0 to 2 rad.
Skeleton limb() {
  Skeleton skeleton;
  const auto add_bone = [&](int parent, double length_m, const std::array<std::optional<AngleRange>, 3>& limits) {
    Bone& bone = skeleton.bones.emplace_back();
    bone.parent = parent;
    bone.rest_offset_m.y() = length_m;
    bone.rotation_limits = limits;
  };
  add_bone(-1, 0.0, {kFree, kFree, kFree});
  add_bone(0, 0.2, {kFree, kFree, kFree});
  add_bone(1, 0.3, {AngleRange{0.0, 2.0}, std::nullopt, std::nullopt});
  return skeleton;
}

BonePoseHypothesis bone_at(const Quaterniond& rotation, Dof dof, const Vector3d& axis = Vector3d::Zero()) {
  return {.world = {Vector3d(1.0, 2.0, 3.0), rotation}, .dof = dof, .axis = axis};
}

TEST(SquaredRangeExcess, AddsUpTheExcessOfEachAxis) {
  Bone bone;
  bone.rotation_limits = {AngleRange{-0.2, 0.2}, std::nullopt, AngleRange{-1.0, 1.0}};

  EXPECT_NEAR(squared_range_excess(bone, from_rotation_vector({0.15, 0.0, -0.9})), 0.0, kRounding);
  EXPECT_NEAR(squared_range_excess(bone, from_rotation_vector({0.5, 0.0, 0.0})), 0.3 * 0.3, kRounding);
  EXPECT_NEAR(squared_range_excess(bone, from_rotation_vector({-0.5, 0.0, 0.0})), 0.3 * 0.3, kRounding);
  EXPECT_NEAR(squared_range_excess(bone, from_rotation_vector({0.3, 0.4, 1.2})), 0.01 + 0.16 + 0.04, kRounding);
}

TEST(ResolveTwist, ChoosesTheTwistOfLeastRangeExcessAndKeepsTheAxis) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  const Skeleton skeleton = limb();
  for (int trial = 0; trial < 50; ++trial) {
    const Vector3d axis = Vector3d(flat(random), 2.0, flat(random)).normalized();
    const Quaterniond upper = from_rotation_vector(2.0 * Vector3d(flat(random), flat(random), flat(random)));
    const Quaterniond begun = from_rotation_vector(2.0 * Vector3d(flat(random), flat(random), flat(random)));
    std::vector<BonePoseHypothesis> bones{bone_at(Quaterniond::Identity(), Dof::Full), bone_at(upper, Dof::Full),
                                          bone_at(begun, Dof::Swing, axis)};

    resolve_twist(skeleton, bones);

    double least = 1e9;
    for (int i = 0; i < 16; ++i) {
      const Quaterniond twisted = begun * Quaterniond(Eigen::AngleAxisd(i * std::numbers::pi / 8.0, axis));
      least = std::min(least, squared_range_excess(skeleton.bones[2], upper.conjugate() * twisted));
    }
    EXPECT_NEAR(squared_range_excess(skeleton.bones[2], upper.conjugate() * bones[2].world.rotation), least, kRounding);
    EXPECT_LT((bones[2].world.rotation * axis - begun * axis).norm(), kRounding);
    EXPECT_EQ(bones[2].world.position, Vector3d(1.0, 2.0, 3.0));
  }
}

TEST(ResolveTwist, TwistsAnUpperBoneSoThatTheHingeBelowBendsWithinItsRange) {
  // The upper bone is a quarter turn about its length away from the plane in which the lower bone bends.
  // The range of the upper bone alone would leave the twist at 0.
  Skeleton skeleton = limb();
  skeleton.bones[1].rotation_limits[1] = AngleRange{-1.5, 1.5};
  const Quaterniond truth(Eigen::AngleAxisd(std::numbers::pi / 2.0, Vector3d::UnitY()));
  const Quaterniond lower = truth * from_rotation_vector({1.2, 0.0, 0.0});
  std::vector<BonePoseHypothesis> bones{bone_at(Quaterniond::Identity(), Dof::Full),
                                        bone_at(Quaterniond::Identity(), Dof::Swing, Vector3d::UnitY()),
                                        bone_at(lower, Dof::Full)};

  resolve_twist(skeleton, bones);

  EXPECT_LT(test::angle_between(bones[1].world.rotation, truth), kRounding);
}

TEST(ResolveTwist, GivesAnUnobservedBoneTheRotationOfItsParent) {
  const Quaterniond root = from_rotation_vector({0.1, 0.2, 0.3});
  std::vector<BonePoseHypothesis> bones{bone_at(root, Dof::Full), bone_at(Quaterniond::Identity(), Dof::None),
                                        bone_at(Quaterniond::Identity(), Dof::None)};

  resolve_twist(limb(), bones);

  EXPECT_LT(test::angle_between(bones[1].world.rotation, root), kRounding);
  EXPECT_LT(test::angle_between(bones[2].world.rotation, root), kRounding);
}

TEST(ToLocalPoses, RecoversTheJointRotationsOfAPose) {
  std::mt19937 random(5);
  const MarkerSet set = test::person("baseline41");
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.set_locals(test::random_pose(set, 1.0, random));
  std::vector<BonePoseHypothesis> bones(set.skeleton.bones.size());
  for (std::size_t b = 0; b < bones.size(); ++b) bones[b].world = body.world()[b];
  std::vector<Pose> locals(bones.size());

  to_local_poses(set.skeleton, bones, locals);

  EXPECT_LT((locals[0].position - body.locals()[0].position).norm(), kRounding);
  for (std::size_t b = 0; b < bones.size(); ++b) {
    EXPECT_LT(test::angle_between(locals[b].rotation, body.locals()[b].rotation), kRounding) << b;
  }
}

}  // namespace bone_pose_hypothesis_test
}  // namespace mocap::pose
