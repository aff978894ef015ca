#include "calibration/floor/floor.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "calibration/floor/floor_frame_scale.h"
#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace floor_test {

using Eigen::Vector3d;

// A rig in an arbitrary frame, as after a wand calibration.
const Pose kRigFromWorld{{0.3, -1.2, 4.0},
                         Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Vector3d(0.4, -1.0, 0.3).normalized()))};

Rig rig_of_its_own() { return in_world({kRigFromWorld, 0.0}, scene::ring_rig({.cameras = 4})); }

std::vector<Vector3d> in_rig(std::vector<Vector3d> points) {
  for (Vector3d& point : points) point = kRigFromWorld * point;
  return points;
}

TEST(Floor, IsDefinedByTheFloorFrame) {
  const Rig truth = scene::ring_rig({.cameras = 4});
  const auto points = in_rig({{0.9, 0.4, 0.02}, {0.0, 0.4, 0.02}, {0.0, 0.0, 0.02}, {0.6, 0.0, 0.02}});

  const auto floor = floor_from_frame(points, {.long_m = 0.6, .short_m = 0.4, .height_m = 0.02}, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  const Rig laid = in_world(*floor, rig_of_its_own());
  for (std::size_t c = 0; c < laid.size(); ++c) {
    EXPECT_LT((laid[c].centre().v - truth[c].centre().v).norm(), 1e-9);
    EXPECT_LT((laid[c].camera_from_world.rotation - truth[c].camera_from_world.rotation).norm(), 1e-9);
  }
}

TEST(Floor, RefusesAFrameWithExchangedArms) {
  // As seen by a mirrored rig.
  const auto points = in_rig({{0.0, 0.6, 0.0}, {0.0, 0.0, 0.0}, {0.4, 0.0, 0.0}});

  const auto floor = floor_from_frame(points, {.long_m = 0.6, .short_m = 0.4}, rig_of_its_own());

  ASSERT_FALSE(floor);
  EXPECT_NE(floor.error().message.find("mirrored"), std::string::npos) << floor.error().message;
}

TEST(Floor, RefusesMarkersThatFormNoFrame) {
  const auto points = in_rig({{0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}, {0.3, 0.4, 0.0}});

  EXPECT_FALSE(floor_from_frame(points, {.long_m = 0.6, .short_m = 0.4}, rig_of_its_own()));
}

TEST(Floor, IsThePlaneThroughMarkers) {
  const auto points = in_rig({{1.0, 0.5, 0.01}, {-1.0, 0.7, 0.01}, {0.2, -1.5, 0.01}, {1.1, -1.0, 0.01}});

  const auto floor = floor_from_points(points, 0.01, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  for (const CameraModel& camera : in_world(*floor, rig_of_its_own())) EXPECT_NEAR(camera.centre().v.z(), 2.4, 1e-9);
  EXPECT_LT(floor->rms_m, 1e-7);  // the square root of rounding errors
}

TEST(Floor, RefusesAMarkerThatIsNotOnTheFloorAndNamesIt) {
  const auto points =
      in_rig({{1.0, 0.5, 0.01}, {-1.0, 0.7, 0.01}, {0.2, -1.5, 0.01}, {1.1, -1.0, 0.01}, {0.1, 0.0, 0.3}});

  const auto floor = floor_from_points(points, 0.01, rig_of_its_own());

  ASSERT_FALSE(floor);
  const std::string& message = floor.error().message;
  EXPECT_NE(message.find("mm rms off one plane, expected at most 15"), std::string::npos) << message;
  const Vector3d& away = points.back();
  const std::string place = fmt::format("at ({:.2f}, {:.2f}, {:.2f}) m", away.x(), away.y(), away.z());
  EXPECT_NE(message.find(place), std::string::npos) << message;
}

TEST(Floor, NamesTheMarkerWithoutWhichTheOthersFitAndNotTheFarthest) {
  // The wrong marker tilts the plane, from which the fourth one is then farthest (57 mm, the wrong one 24 mm).
  const auto points = in_rig({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.9, 0.8, 0.0}, {2.5, 2.5, 0.3}});

  const auto floor = floor_from_points(points, 0.0, rig_of_its_own());

  ASSERT_FALSE(floor);
  const Vector3d& away = points.back();
  const std::string place = fmt::format("without the one at ({:.2f}, {:.2f}, {:.2f}) m", away.x(), away.y(), away.z());
  EXPECT_NE(floor.error().message.find(place), std::string::npos) << floor.error().message;
  EXPECT_NE(floor.error().message.find("the others are 0 mm rms off"), std::string::npos) << floor.error().message;
}

TEST(Floor, NamesNoMarkerOfFour) {
  const auto points = in_rig({{1.0, 0.5, 0.0}, {-1.0, 0.7, 0.0}, {0.2, -1.5, 0.3}, {1.1, -1.0, 0.0}});

  const auto floor = floor_from_points(points, 0.0, rig_of_its_own());

  ASSERT_FALSE(floor);
  const std::string& message = floor.error().message;
  EXPECT_NE(message.find("4 markers do not show which one"), std::string::npos) << message;
  EXPECT_EQ(message.find(" at ("), std::string::npos) << message;
}

TEST(Floor, IsNotCheckedByThreeMarkers) {
  std::vector<Vector3d> points{{1.0, 0.5, 0.0}, {-1.0, 0.7, 0.0}, {0.2, -1.5, 0.4}};  // one is not on the floor

  const auto three = floor_from_points(in_rig(points), 0.0, rig_of_its_own());
  points = {{1.0, 0.5, 0.0}, {-1.0, 0.7, 0.0}, {0.2, -1.5, 0.0}, {1.1, -1.0, 0.0}};
  const auto four = floor_from_points(in_rig(points), 0.0, rig_of_its_own());

  ASSERT_TRUE(three && four);
  EXPECT_FALSE(three->is_checked);
  EXPECT_TRUE(four->is_checked);
}

TEST(Floor, RefusesMarkersOnOneLine) {
  EXPECT_FALSE(floor_from_points(in_rig({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}}), 0.0, rig_of_its_own()));
}

TEST(Floor, IsThePlaneBelowAWalk) {
  // A fifth of the points are on standing feet, the others on swinging feet and on the body.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::uniform_real_distribution<double> height(0.0, 1.7);
  std::normal_distribution<double> noise(0.0, 0.0005);
  std::vector<Vector3d> points;
  for (int i = 0; i < 3000; ++i) {
    const double z = i % 5 == 0 ? 0.04 + noise(random) : 0.04 + height(random);
    points.emplace_back(place(random), place(random), z);
  }

  const auto floor = floor_from_walk(in_rig(points), 0.04, rig_of_its_own());

  ASSERT_TRUE(floor) << floor.error().message;
  for (const CameraModel& camera : in_world(*floor, rig_of_its_own())) EXPECT_NEAR(camera.centre().v.z(), 2.4, 0.01);
}

TEST(FloorFrameScale, IsThatOfTheOnlyFrameWithTheSameShape) {
  const FloorFrame frame{.long_m = 0.6, .short_m = 0.4};
  const std::vector<Vector3d> larger{{0.0, 0.0, 0.0}, {0.75, 0.0, 0.0}, {0.0, 0.5, 0.0}};
  std::vector<Vector3d> two = larger;
  for (const Vector3d& point : larger) two.push_back(point + Vector3d(3.0, 0.0, 0.0));

  const auto scale = floor_frame_scale(larger, frame);

  ASSERT_TRUE(scale);
  EXPECT_NEAR(*scale, 1.25, 1e-12);
  EXPECT_FALSE(floor_frame_scale(two, frame));
}

}  // namespace floor_test
}  // namespace mocap::calibration
