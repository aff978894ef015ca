#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "kinematics/bone_shapes.h"
#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"
#include "support/archived.h"
#include "support/test_body.h"

namespace mocap::kinematics {
namespace archive_test {

using test::archived;
using test::person;
using test::take_over;

std::vector<Eigen::Vector3d> rest_offsets(const MarkerSet& set, double scale) {
  std::vector<Eigen::Vector3d> offsets_m;
  for (const Bone& bone : set.skeleton.bones) offsets_m.push_back(scale * bone.rest_offset_m);
  return offsets_m;
}

std::vector<Eigen::Vector3d> marker_offsets(const MarkerSet& set, double scale) {
  std::vector<Eigen::Vector3d> offsets_m;
  for (const MarkerOnBone& marker : set.markers) offsets_m.push_back(scale * marker.offset_m);
  return offsets_m;
}

// A fit that has fitted offsets, a hinge axis, a swivel plane, and a pose.
PoseFit experienced(const MarkerSet& set, PoseFit::Lengths lengths, const std::vector<Observation>& seen) {
  PoseFit fit(set, lengths);
  fit.refit(rest_offsets(set, 1.04), marker_offsets(set, 1.03));
  const std::size_t elbow = test::bone_named(set, "LeftLowArm"), knee = test::bone_named(set, "RightLowLeg");
  fit.set_hinge_axis(elbow, from_rotation_vector({0.3, 0.0, 0.0}).toRotationMatrix());
  fit.set_swivel_plane(knee, {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), 300.0});
  if (lengths == PoseFit::Lengths::Free) fit.place({}, 1.1);
  (void)fit.solve(seen, PosePrior{}, 20);
  EXPECT_TRUE(fit.compute_covariances(seen, PosePrior{}));
  return fit;
}

TEST(Archive, LetsAPoseFitContinue) {
  const MarkerSet set = person("baseline41");
  std::mt19937 random(1);
  PoseFit truth(set, PoseFit::Lengths::Fixed);
  truth.set_locals(test::random_pose(set, 0.5, random));
  for (const auto lengths : {PoseFit::Lengths::Fixed, PoseFit::Lengths::Free}) {
    PoseFit fit = experienced(set, lengths, test::see(truth));
    PoseFit other(set, lengths);
    ASSERT_TRUE(take_over(archived(fit), other));

    for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
      EXPECT_EQ(fit.world()[b].rotation.coeffs(), other.world()[b].rotation.coeffs()) << b;
      EXPECT_EQ(fit.joint_covariance(b), other.joint_covariance(b)) << b;
      EXPECT_EQ(fit.local_covariance(b), other.local_covariance(b)) << b;
    }
    for (int trial = 0; trial < 5; ++trial) {
      truth.set_locals(test::random_pose(set, 0.5, random));
      EXPECT_EQ(fit.solve(test::see(truth), PosePrior{}, 5).cost, other.solve(test::see(truth), PosePrior{}, 5).cost);
      EXPECT_EQ(archived(fit), archived(other));
    }
  }
}

TEST(Archive, HasTheFittedOffsetsOfBoneShapes) {
  MarkerSet set = person("baseline41");
  BoneShapes shapes(set), other(set);
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= 1.1;
  for (MarkerOnBone& marker : set.markers) marker.offset_m *= 0.9;
  shapes.refit(set);

  ASSERT_TRUE(take_over(archived(shapes), other));

  for (std::size_t b = 0; b < shapes.size(); ++b) {
    for (std::size_t i = 0; i < shapes.of(b).points.size(); ++i)
      EXPECT_EQ(shapes.of(b).points[i].position_m, other.of(b).points[i].position_m);
    for (std::size_t i = 0; i < shapes.of(b).joints.size(); ++i) {
      EXPECT_EQ(shapes.of(b).joints[i].joint_in_bone_m, other.of(b).joints[i].joint_in_bone_m);
      EXPECT_EQ(shapes.of(b).joints[i].joint_in_neighbour_m, other.of(b).joints[i].joint_in_neighbour_m);
    }
  }
}

TEST(Archive, OfAnotherMarkerSetIsRefused) {
  PoseFit fit(person("baseline41"), PoseFit::Lengths::Fixed);
  PoseFit other(person("openmocap18"), PoseFit::Lengths::Fixed);

  EXPECT_FALSE(take_over(archived(fit), other));
}

}  // namespace archive_test
}  // namespace mocap::kinematics
