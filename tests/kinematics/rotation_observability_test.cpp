#include "kinematics/rotation_observability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "support/test_body.h"

namespace mocap::kinematics {
namespace rotation_observability_test {

using test::person;

bool is_observable(const MarkerSet& set, const std::string& bone) {
  const auto& bones = set.skeleton.bones;
  const auto found = std::find_if(bones.begin(), bones.end(), [&](const Bone& one) { return one.name == bone; });
  return rotation_observability(set)[static_cast<std::size_t>(found - bones.begin())];
}

MarkerSet without(MarkerSet set, const std::string& marker) {
  std::erase_if(set.markers, [&](const MarkerOnBone& one) { return one.name == marker; });
  return set;
}

TEST(RotationObservability, HoldsForEveryBoneOfBaseline41) {
  const std::vector<bool> observable = rotation_observability(person("baseline41"));

  EXPECT_EQ(std::count(observable.begin(), observable.end(), true), static_cast<std::ptrdiff_t>(observable.size()));
}

TEST(RotationObservability, FailsForAHandWithOneMarker) {
  const MarkerSet set = without(person("baseline41"), "LHandIn");

  EXPECT_FALSE(is_observable(set, "LeftHand"));
  EXPECT_TRUE(is_observable(set, "RightHand"));
  EXPECT_TRUE(is_observable(set, "LeftLowArm"));
}

TEST(RotationObservability, FailsForANeckWithoutAMarkerOfItsOwn) {
  const MarkerSet set = without(person("baseline41"), "BackTop");

  EXPECT_FALSE(is_observable(set, "Neck"));
  EXPECT_TRUE(is_observable(set, "Head"));
}

TEST(RotationObservability, FailsForTheTwistOfLimbsWithOneMarkerPerJoint) {
  const MarkerSet set = person("openmocap18");

  EXPECT_TRUE(is_observable(set, "Hips"));
  EXPECT_FALSE(is_observable(set, "LeftHand"));
  EXPECT_FALSE(is_observable(set, "LeftFoot"));
}

}  // namespace rotation_observability_test
}  // namespace mocap::kinematics
