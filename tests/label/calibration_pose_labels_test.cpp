#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "label/label_world.h"

namespace mocap::label {
namespace {

using test::LabelWorld;

/// Stands with lowered arms, and walks on the spot when the time begins.
test::Moves a_pose_then_walking(double lowered_rad) {
  return [lowered_rad, walks = test::walking()](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    const Eigen::Quaterniond walking = walks(bone, t_s);
    const double left = 1.0 - std::min(1.0, t_s);
    if (bone == "LeftUpArm")
      return (kinematics::from_rotation_vector({-left * lowered_rad, 0.0, 0.0}) * walking).normalized();
    if (bone == "RightUpArm")
      return (kinematics::from_rotation_vector({left * lowered_rad, 0.0, 0.0}) * walking).normalized();
    return walking;
  };
}

class LabelStanding : public ::testing::TestWithParam<const char*> {};

TEST_P(LabelStanding, NamesAnAPoseOfAnybodyAndKeepsAllNamesInMotion) {
  for (const double lowered_rad : {0.65, 0.785, 0.95}) {
    LabelWorld world;
    world.add(GetParam(), a_pose_then_walking(lowered_rad), {0.3, -0.2, 0.95}, 2.0, 0.95);
    world.begin();
    EXPECT_EQ(world.rights(), world.markers()) << lowered_rad;

    world.step(240);

    EXPECT_EQ(world.rights(), world.markers()) << lowered_rad;
  }
}

TEST_P(LabelStanding, MeasuresWhoStandsInAPoseInTheFramesOfTheRestPose) {
  LabelWorld world;
  const LabelWorld::Person& person = world.add(GetParam(), a_pose_then_walking(0.785), {0.0, 0.0, 0.95}, 0.0, 0.95);
  world.begin();
  const std::optional<SubjectFit> fit = world.take_fit();

  ASSERT_TRUE(fit);
  for (std::size_t b = 1; b < person.set.skeleton.bones.size(); ++b) {
    const Bone& bone = person.set.skeleton.bones[b];
    EXPECT_LT((fit->rest_offsets_m[b] - bone.rest_offset_m).norm(), 0.03) << bone.name;
  }
  for (std::size_t m = 0; m < person.set.markers.size(); ++m) {
    EXPECT_LT((fit->marker_offsets_m[m] - person.set.markers[m].offset_m).norm(), 0.03) << person.set.markers[m].name;
  }
}

INSTANTIATE_TEST_SUITE_P(ShippedSets, LabelStanding, ::testing::Values("openmocap18", "baseline41"),
                         [](const auto& set) { return std::string(set.param); });

// More than is searched at once. Lights that were there before anybody came are not all that is looked at.
TEST(LabelCrowd, WhoStandsBeforeAWallOfLightsIsNamed) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  for (int i = 0; i < 170; ++i) world.ghosts.emplace_back(3.0, 0.1 * (i / 10) - 0.8, 0.2 * (i % 10));

  world.begin();

  EXPECT_EQ(world.rights(), world.markers());
}

}  // namespace
}  // namespace mocap::label
