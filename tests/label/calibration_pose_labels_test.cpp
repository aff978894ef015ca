#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "label/label_world.h"

namespace mocap::label {
namespace calibration_pose_labels_test {

using test::LabelWorld;

/// Arms lowered by an angle at first, then walking on the spot.
test::Motion a_pose_then_walking(double lowered_rad) {
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

class CalibrationPoseLabels : public ::testing::TestWithParam<const char*> {};

TEST_P(CalibrationPoseLabels, StartInAnAPoseAndStayCorrectInMotion) {
  for (const double lowered_rad : {0.65, 0.785, 0.95}) {
    LabelWorld world;
    world.add(GetParam(), a_pose_then_walking(lowered_rad), {0.3, -0.2, 0.95}, 2.0, 0.95);
    world.identify_all();
    EXPECT_EQ(world.correct_count(), world.marker_count()) << lowered_rad;

    world.step(240);

    EXPECT_EQ(world.correct_count(), world.marker_count()) << lowered_rad;
  }
}

TEST_P(CalibrationPoseLabels, GiveOffsetsInTheFramesOfTheRestPose) {
  LabelWorld world;
  const LabelWorld::Person& person = world.add(GetParam(), a_pose_then_walking(0.785), {0.0, 0.0, 0.95}, 0.0, 0.95);
  world.identify_all();
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

INSTANTIATE_TEST_SUITE_P(ShippedSets, CalibrationPoseLabels, ::testing::Values("openmocap18", "baseline41"),
                         [](const auto& set) { return std::string(set.param); });

// More points than one search uses, most of them older than the tracks of the person.
TEST(SubjectSearch, FindsAPersonInFrontOfAWallOfLights) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  for (int i = 0; i < 170; ++i) world.clutter.emplace_back(3.0, 0.1 * (i / 10) - 0.8, 0.2 * (i % 10));

  world.identify_all();

  EXPECT_EQ(world.correct_count(), world.marker_count());
}

}  // namespace calibration_pose_labels_test
}  // namespace mocap::label
