#include "lib/functional/segment_motion.h"

#include <gtest/gtest.h>

#include "test_motion.h"

namespace mocap::functional {
namespace segment_motion_test {

Pose pose_at(std::size_t frame) {
  const double rad = 0.03 * static_cast<double>(frame);
  return {{0.2 * std::sin(rad), 0.1, 1.0}, kinematics::from_rotation_vector({rad, 0.5 * std::sin(rad), 0.0})};
}

const std::vector<Eigen::Vector3d> kShape_m{{0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}, {0.0, 0.15, 0.0}};

TEST(SegmentMotion, HasTheAxesOfTheWorldInTheReferenceFrame) {
  const auto take =
      test_motion::take_of(60, 3, 1e-4, [](std::size_t f, std::size_t m) { return pose_at(f) * kShape_m[m]; });

  const SegmentMotion motion = track_segment(take, {0, 1, 2}, 25);

  ASSERT_TRUE(motion.has_orientation());
  EXPECT_NEAR(motion.world_from_segment[25]->rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.0, 1e-9);
  EXPECT_NEAR((motion.shape_m[0] + motion.shape_m[1] + motion.shape_m[2]).norm(), 0.0, 1e-9);
  for (const std::size_t frame : {0u, 10u, 59u}) {
    const Eigen::Quaterniond turned = pose_at(frame).rotation * pose_at(25).rotation.conjugate();
    EXPECT_LT(motion.world_from_segment[frame]->rotation.angularDistance(turned), 0.005) << frame;
    EXPECT_LT((*motion.world_from_segment[frame] * motion.shape_m[1] - take.frame(frame)[1]).norm(), 5e-4) << frame;
  }
}

TEST(SegmentMotion, OfTwoMarkersHasAnOrientationOnceItsJointIsKnown) {
  const auto take =
      test_motion::take_of(60, 2, 1e-4, [](std::size_t f, std::size_t m) { return pose_at(f) * kShape_m[m]; });
  std::vector<Eigen::Vector3d> joint_m;
  for (std::size_t f = 0; f < 60; ++f) joint_m.push_back(pose_at(f) * kShape_m[2]);

  const SegmentMotion motion = track_segment(take, {0, 1}, 0, joint_m);

  EXPECT_FALSE(track_segment(take, {0, 1}, 0).has_orientation());
  ASSERT_TRUE(motion.has_orientation());
  ASSERT_EQ(motion.shape_m.size(), 2u);
  EXPECT_NEAR((motion.joint_m - motion.shape_m[0]).norm(), 0.15, 0.001);
}

TEST(SegmentMotion, OfThreeMarkersOnALineHasNoOrientation) {
  const auto take = test_motion::take_of(60, 3, 1e-4, [](std::size_t f, std::size_t m) {
    return pose_at(f) * Eigen::Vector3d(0.1 * static_cast<double>(m), 0.0, 0.0);
  });

  EXPECT_FALSE(track_segment(take, {0, 1, 2}, 0).has_orientation());
}

}  // namespace segment_motion_test
}  // namespace mocap::functional
