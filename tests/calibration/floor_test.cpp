#include "calibration/floor/floor.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector3d;

// A rig in a frame of its own, as a wand gives it: turned and moved against the world.
const Pose kRigFromWorld{{0.3, -1.2, 4.0},
                         Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Vector3d(0.4, -1.0, 0.3).normalized()))};

Rig rig_of_its_own() { return laid_on({kRigFromWorld, 0.0}, scene::ring_rig({.cameras = 4})); }

std::vector<Vector3d> in_rig(std::vector<Vector3d> points) {
  for (Vector3d& point : points) point = kRigFromWorld * point;
  return points;
}

TEST(Floor, IsWhereTheFrameLies) {
  const Rig truth = scene::ring_rig({.cameras = 4});
  const auto points = in_rig({{0.9, 0.4, 0.02}, {0.0, 0.4, 0.02}, {0.0, 0.0, 0.02}, {0.6, 0.0, 0.02}});

  const auto floor = floor_by_frame(points, {.long_m = 0.6, .short_m = 0.4, .height_m = 0.02}, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  const Rig laid = laid_on(*floor, rig_of_its_own());
  for (std::size_t c = 0; c < laid.size(); ++c) {
    EXPECT_LT((laid[c].centre().v - truth[c].centre().v).norm(), 1e-9);
    EXPECT_LT((laid[c].camera_from_world.rotation - truth[c].camera_from_world.rotation).norm(), 1e-9);
  }
}

TEST(Floor, RefusesAFrameWhoseArmsAreExchanged) {
  // As a mirrored rig shows it.
  const auto points = in_rig({{0.0, 0.6, 0.0}, {0.0, 0.0, 0.0}, {0.4, 0.0, 0.0}});

  const auto floor = floor_by_frame(points, {.long_m = 0.6, .short_m = 0.4}, rig_of_its_own());

  ASSERT_FALSE(floor);
  EXPECT_NE(floor.error().message.find("mirrored"), std::string::npos) << floor.error().message;
}

TEST(Floor, RefusesMarkersThatAreNoFrame) {
  const auto points = in_rig({{0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}, {0.3, 0.4, 0.0}});

  EXPECT_FALSE(floor_by_frame(points, {.long_m = 0.6, .short_m = 0.4}, rig_of_its_own()));
}

TEST(Floor, IsThePlaneOfMarkersOnIt) {
  const auto points = in_rig({{1.0, 0.5, 0.01}, {-1.0, 0.7, 0.01}, {0.2, -1.5, 0.01}, {1.1, -1.0, 0.01}});

  const auto floor = floor_by_points(points, 0.01, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  for (const CameraModel& camera : laid_on(*floor, rig_of_its_own())) EXPECT_NEAR(camera.centre().v.z(), 2.4, 1e-9);
  EXPECT_LT(floor->rms_m, 1e-7);  // the root of rounding
}

TEST(Floor, RefusesMarkersOnOneLine) {
  EXPECT_FALSE(floor_by_points(in_rig({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}}), 0.0, rig_of_its_own()));
}

TEST(Floor, IsWhatAWalkNeverGoesBelow) {
  // Feet that stand, feet that swing, and the rest of a body.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::uniform_real_distribution<double> height(0.0, 1.7);
  std::normal_distribution<double> noise(0.0, 0.0005);
  std::vector<Vector3d> points;
  for (int i = 0; i < 3000; ++i) {
    const double z = i % 5 == 0 ? 0.04 + noise(random) : 0.04 + height(random);
    points.emplace_back(place(random), place(random), z);
  }

  const auto floor = floor_by_walk(in_rig(points), 0.04, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  for (const CameraModel& camera : laid_on(*floor, rig_of_its_own())) EXPECT_NEAR(camera.centre().v.z(), 2.4, 0.01);
}

}  // namespace
}  // namespace mocap::calibration
