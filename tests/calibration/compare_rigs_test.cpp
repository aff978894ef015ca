#include "calibration/rig/compare_rigs.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <numbers>

#include "calibration/floor/floor.h"
#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace compare_rigs_test {

constexpr double kDegree = std::numbers::pi / 180.0;

Rig ring(int cameras) { return simworld::WandWorld({.cameras = cameras}, Wand{{0.0, 0.5}}, 3).truth(); }

// The same rig in a rotated and translated world.
Rig elsewhere(const Rig& rig) {
  Floor floor;
  floor.world_from_rig.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, 0.3, 0.9).normalized());
  floor.world_from_rig.position = {0.3, -0.4, 1.2};
  return in_world(floor, rig);
}

// Rotates the camera about its centre, then moves it.
void bump(CameraModel& camera, double angle_rad, const Eigen::Vector3d& move_m) {
  const Eigen::Vector3d centre = camera.centre().v + move_m;
  camera.camera_from_world.rotation =
      Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()) * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
}

TEST(CompareRigs, IgnoresAChangeOfTheWorldFrame) {
  for (const int cameras : {2, 3, 8}) {
    const Rig before = ring(cameras);
    for (const RigAlignment alignment : {RigAlignment::AllCameras, RigAlignment::RobustToMoved}) {
      const auto change = compare_rigs(before, elsewhere(before), alignment);

      ASSERT_TRUE(change);
      EXPECT_LT(change->position_m, 1e-9);
      EXPECT_LT(change->rotation_rad, 1e-7);  // the angle of a near identity is the square root of rounding errors
      EXPECT_NEAR(change->scale, 1.0, 1e-12);
      EXPECT_NEAR(change->world_rotated_rad, 0.7, 1e-9);
      for (const CameraChange& camera : change->cameras) {
        EXPECT_GT(camera.raw_position_m, 0.1);
        ASSERT_TRUE(camera.image_px);
        EXPECT_LT(*camera.image_px, 1e-6);
      }
    }
  }
}

TEST(CompareRigs, ABumpedCameraDoesNotAffectTheRobustAlignment) {
  const Rig before = ring(8);
  Rig after = elsewhere(before);
  bump(after[5], 0.3 * kDegree, {0.003, 0.004, 0.0});

  const auto change = compare_rigs(before, after, RigAlignment::RobustToMoved);

  ASSERT_TRUE(change);
  for (std::size_t c = 0; c < 8; ++c) {
    const CameraChange& camera = change->cameras[c];
    EXPECT_NEAR(camera.position_m, c == 5 ? 0.005 : 0.0, 1e-5) << c;
    EXPECT_NEAR(camera.rotation_rad, c == 5 ? 0.3 * kDegree : 0.0, 1e-5) << c;
  }
  EXPECT_GT(change->cameras[5].image_px.value_or(0.0), 3.0);  // 0.3 degrees at a focal length above 1000 px are 5 px
}

TEST(CompareRigs, ACameraThatWasTurnedAwayHasNoImageChange) {
  const Rig before = ring(8);
  Rig after = before;
  bump(after[5], std::numbers::pi, {0.0, 0.0, 0.0});

  const auto change = compare_rigs(before, after, RigAlignment::RobustToMoved);

  ASSERT_TRUE(change);
  EXPECT_FALSE(change->cameras[5].image_px) << "it is no small change";
  EXPECT_TRUE(change->cameras[4].image_px);
}

TEST(CompareRigs, RefusesARigWithoutPoses) {
  const Rig before = ring(4);
  Rig lenses = before;
  for (CameraModel& camera : lenses) camera.camera_from_world = {};

  const auto to_lenses = compare_rigs(before, lenses, RigAlignment::RobustToMoved);
  const auto from_lenses = compare_rigs(lenses, before, RigAlignment::AllCameras);

  ASSERT_FALSE(to_lenses);
  EXPECT_THAT(to_lenses.error().message, testing::HasSubstr("all cameras of the new rig are at one place"));
  ASSERT_FALSE(from_lenses);
  EXPECT_THAT(from_lenses.error().message, testing::HasSubstr("all cameras of the old rig are at one place"));
}

TEST(CompareRigs, AlignsAllCamerasEquallyAgainstATruth) {
  const Rig truth = ring(8);
  Rig found = elsewhere(truth);
  bump(found[5], 0.0, {0.008, 0.0, 0.0});

  const auto change = compare_rigs(truth, found, RigAlignment::AllCameras);

  ASSERT_TRUE(change);
  // One of eight cameras has an error of 8 mm: 8 / sqrt(8) = 2.8 mm without alignment; the alignment reduces it.
  EXPECT_LT(change->position_m, 0.0028);
  EXPECT_GT(change->position_m, 0.0015);
  EXPECT_GT(change->cameras[0].position_m, 1e-4);
}

TEST(CompareRigs, ReportsScaleFocalLengthAndMissingCameras) {
  const Rig before = ring(4);
  Rig after = before;
  for (CameraModel& camera : after) camera.camera_from_world.translation *= 1.002;
  after[1].lens.fx_px *= 1.01;
  after[3].name = "new one";

  const auto change = compare_rigs(before, after, RigAlignment::AllCameras);

  ASSERT_TRUE(change);
  EXPECT_NEAR(change->scale, 1.002, 1e-9);
  EXPECT_NEAR(change->cameras[1].focal_change, 0.01, 1e-9);
  EXPECT_THAT(change->only_old, testing::ElementsAre(before[3].name));
  EXPECT_THAT(change->only_new, testing::ElementsAre("new one"));
}

TEST(CompareRigs, RefusesRigsWithFewerThanTwoCommonCameras) {
  Rig before = ring(2);
  Rig after = before;
  after[0].name.append("-else");

  const auto change = compare_rigs(before, after, RigAlignment::AllCameras);

  ASSERT_FALSE(change);
  EXPECT_THAT(change.error().message, testing::HasSubstr("1 camera is in both rigs by name"));
}

}  // namespace compare_rigs_test
}  // namespace mocap::calibration
