#include "kinematics/rotation_observability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "support/test_body.h"

namespace mocap::kinematics {
namespace {

using test::person;

bool tells(const MarkerSet& set, const std::string& bone) {
  const auto& bones = set.skeleton.bones;
  const auto found = std::find_if(bones.begin(), bones.end(), [&](const Bone& one) { return one.name == bone; });
  return rotation_observability(set)[static_cast<std::size_t>(found - bones.begin())];
}

MarkerSet without(MarkerSet set, const std::string& marker) {
  std::erase_if(set.markers, [&](const MarkerOnBone& one) { return one.name == marker; });
  return set;
}

TEST(TurnsTold, EveryBoneOfBaseline41IsTold) {
  const std::vector<bool> told = rotation_observability(person("baseline41"));

  EXPECT_EQ(std::count(told.begin(), told.end(), true), static_cast<std::ptrdiff_t>(told.size()));
}

TEST(TurnsTold, AHandOfOneMarkerMayTurnAboutTheLineToIt) {
  const MarkerSet set = without(person("baseline41"), "LHandIn");

  EXPECT_FALSE(tells(set, "LeftHand"));
  EXPECT_TRUE(tells(set, "RightHand"));
  EXPECT_TRUE(tells(set, "LeftLowArm"));
}

TEST(TurnsTold, ANeckBetweenChestAndHeadNeedsAMarkerOfItsOwn) {
  const MarkerSet set = without(person("baseline41"), "BackTop");

  EXPECT_FALSE(tells(set, "Neck"));
  EXPECT_TRUE(tells(set, "Head"));
}

TEST(TurnsTold, OneMarkerAJointTellsNoLimbsTurnAboutItself) {
  const MarkerSet set = person("openmocap18");

  EXPECT_TRUE(tells(set, "Hips"));
  EXPECT_FALSE(tells(set, "LeftHand"));
  EXPECT_FALSE(tells(set, "LeftFoot"));
}

}  // namespace
}  // namespace mocap::kinematics
