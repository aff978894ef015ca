#include "kinematics/hinge_range.h"

#include <gtest/gtest.h>

#include <string>

#include "support/test_body.h"

namespace mocap::kinematics {
namespace hinge_range_test {

TEST(HingeRange, ElbowsAndKneesBendOneWayAboutOneAxisOnly) {
  const MarkerSet set = test::person("baseline41");

  int hinges = 0;
  for (const Bone& bone : set.skeleton.bones) {
    if (!bone.name.ends_with("LowArm") && !bone.name.ends_with("LowLeg")) continue;
    int one_way = 0, minor = 0;
    for (const auto& range : bone.rotation_limits) {
      one_way += bends_one_way(reach_of(*range)) ? 1 : 0;
      minor += reach_of(*range).larger_rad() < kMaxMinorRange_rad ? 1 : 0;
    }
    EXPECT_EQ(one_way, 1) << bone.name;
    EXPECT_EQ(minor, 1) << bone.name;
    ++hinges;
  }
  EXPECT_EQ(hinges, 4);
}

TEST(HingeRange, ReachIsNeverNegative) {
  const AxisReach reach = reach_of({.min_rad = 0.2, .max_rad = 0.9});

  EXPECT_EQ(reach.negative_rad, 0.0);
  EXPECT_EQ(reach.positive_rad, 0.9);
}

}  // namespace hinge_range_test
}  // namespace mocap::kinematics
