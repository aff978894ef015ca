#include "calibration/rig/previous_rig.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace previous_rig_test {

Rig scaled(Rig rig, double scale) {
  for (CameraModel& camera : rig) camera.camera_from_world.translation *= scale;
  return rig;
}

Rig with_moved_camera(Rig rig, std::size_t index, double distance_m) {
  CameraModel& camera = rig[index];
  const Eigen::Vector3d centre = camera.centre().v + Eigen::Vector3d(distance_m, 0.0, 0.0);
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  return rig;
}

TEST(PreviousRig, MeasuresTheScaleOfUnmovedCameras) {
  const Rig rig = scene::ring_rig({.cameras = 5});

  const auto scale = scale_of_previous(scaled(rig, 1.25), rig);

  ASSERT_TRUE(scale);
  EXPECT_NEAR(*scale, 1.25, 1e-9);
}

TEST(PreviousRig, HasNoScaleIfCamerasWereMoved) {
  const Rig rig = scene::ring_rig({.cameras = 4});
  const Rig moved = with_moved_camera(with_moved_camera(rig, 0, 1.0), 1, -0.7);

  EXPECT_FALSE(scale_of_previous(moved, rig));
  EXPECT_FALSE(scale_of_previous(Rig(rig.begin(), rig.begin() + 2), Rig(rig.begin(), rig.begin() + 2)));
}

TEST(PreviousRig, FindsTheWorldOfThePreviousRigWithoutAMovedCamera) {
  const Rig previous = scene::ring_rig({.cameras = 6});
  const Pose away{{0.5, -1.0, 2.0}, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.0, 0.6, 0.8)))};
  const Rig rig = in_world({away, 0.0}, with_moved_camera(previous, 2, 0.3));

  const auto floor = pose_in_previous_world(rig, previous);

  ASSERT_TRUE(floor);
  const Rig back = in_world(*floor, rig);
  for (const std::size_t c : {0u, 1u, 3u, 4u, 5u})
    EXPECT_LT((back[c].centre().v - previous[c].centre().v).norm(), 1e-9) << c;
}

TEST(PreviousRig, HasNoWorldIfMostCamerasWereMoved) {
  const Rig previous = scene::ring_rig({.cameras = 4});
  Rig rig = previous;
  for (std::size_t c = 0; c < 3; ++c) rig = with_moved_camera(rig, c, 0.2 * static_cast<double>(c + 1));

  EXPECT_FALSE(pose_in_previous_world(rig, previous));
}

// Three cameras on a wall; the middle one is 5 cm off the line through the others.
Rig on_a_wall() {
  Rig rig = scene::ring_rig({.cameras = 3});
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d eye(2.0 * c - 2.0, c == 1 ? 0.05 : 0.0, 2.5);
    rig[static_cast<std::size_t>(c)].camera_from_world = scene::look_at(eye, {0.0, 4.0, 1.0});
  }
  return rig;
}

TEST(PreviousRig, TheOrientationsKeepTheFloorOfCamerasOnALine) {
  const Rig previous = on_a_wall();
  Rig moved = previous;
  const Eigen::Vector3d centre = moved[1].centre().v + Eigen::Vector3d(0.0, 0.0, 0.003);
  moved[1].camera_from_world.translation = -(moved[1].camera_from_world.rotation * centre);
  const Pose away{{0.5, -1.0, 2.0}, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.0, 0.6, 0.8)))};

  const auto floor = pose_in_previous_world(in_world({away, 0.0}, moved), previous);

  ASSERT_TRUE(floor);  // the centres alone rotate the floor by 3.4 degrees: 3 mm at 5 cm from the line
  const double angle_rad = Eigen::AngleAxisd(floor->world_from_rig.rotation * away.rotation).angle();
  EXPECT_LT(std::abs(angle_rad), 0.2 * std::numbers::pi / 180.0);
}

TEST(PreviousRig, HasNoWorldIfTheOrientationsDisagree) {
  const Rig previous = on_a_wall();
  Rig rig = previous;
  for (std::size_t c = 0; c < 3; ++c) {
    const Eigen::Vector3d centre = rig[c].centre().v;
    rig[c].camera_from_world = scene::look_at(centre, {0.0, 4.0, 0.5 + 0.5 * static_cast<double>(c)});
  }

  EXPECT_FALSE(pose_in_previous_world(rig, previous));
}

// Tilts a camera about its own x axis.
Rig with_tilted_camera(Rig rig, std::size_t index, double angle_deg) {
  CameraModel& camera = rig[index];
  const Eigen::Vector3d centre = camera.centre().v;
  camera.camera_from_world.rotation =
      Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitX()).toRotationMatrix() *
      camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  return rig;
}

TEST(PreviousRig, ACameraThatWasAimedAnewKeepsTheFloorOfCamerasOnALine) {
  const Rig previous = on_a_wall();

  const auto floor = pose_in_previous_world(with_tilted_camera(previous, 2, 2.0), previous);

  ASSERT_TRUE(floor) << "all three cameras stand where they were, and two are aimed as before";
  EXPECT_LT(Eigen::AngleAxisd(floor->world_from_rig.rotation).angle(), 1e-9) << "the tilted camera takes no part";
}

TEST(PreviousRig, ThePositionsKeepTheFloorOfCamerasThatWereAllAimedAnew) {
  const Rig previous = scene::ring_rig({.cameras = 4});
  Rig rig = previous;
  for (std::size_t c = 0; c < 4; ++c) rig = with_tilted_camera(rig, c, 3.0 + 8.0 * static_cast<double>(c));

  const auto floor = pose_in_previous_world(rig, previous);

  ASSERT_TRUE(floor);
  EXPECT_LT(Eigen::AngleAxisd(floor->world_from_rig.rotation).angle(), 1e-9);
  EXPECT_LT(floor->rms_m, 1e-9);
}

}  // namespace previous_rig_test
}  // namespace mocap::calibration
