#include "calibration/rig/rig_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace rig_evidence_test {

using Eigen::Vector3d;

const Pose kRigFromRoom{Vector3d(1.0, -2.0, 0.5),
                        Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(1.0, 2.0, -0.5).normalized()))};

/// Five cameras 2.5 m above the floor of a room that look down at its centre, and three wand poses, in the frame of a
/// rig that is tilted against the room. No camera sees the second wand pose.
WandSolution tilted_solution() {
  WandSolution solution;
  Bundle& bundle = solution.bundle;
  bundle.wand = Wand{{0.0, 0.16, 0.5}};
  for (int i = 0; i < 5; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 5.0;
    const Vector3d centre(4.0 * std::cos(angle), 3.0 * std::sin(angle), 2.5);
    const Vector3d forward = (Vector3d(0.0, 0.0, 1.0) - centre).normalized();
    const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
    CameraModel camera;
    camera.name = "camera" + std::to_string(i);
    camera.width_px = 1280;
    camera.height_px = 1024;
    camera.lens = {LensKind::Pinhole, 1000.0, 1000.0, 640.0, 512.0, {}};
    camera.lens.distortion.setZero();
    Eigen::Matrix3d camera_from_room;
    camera_from_room << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    camera.camera_from_world.rotation = camera_from_room * kRigFromRoom.rotation.conjugate().toRotationMatrix();
    camera.camera_from_world.translation = -(camera.camera_from_world.rotation * (kRigFromRoom * centre));
    bundle.rig.push_back(camera);
  }
  for (int p = 0; p < 3; ++p) {
    const WandPose pose{kRigFromRoom * Vector3d(0.2 * p, 0.1, 1.0 + 0.1 * p),
                        kRigFromRoom.rotation * Vector3d::UnitY()};
    bundle.wand_poses.push_back(pose);
    if (p == 1) continue;
    for (int c = 0; c < 5; ++c) {
      for (int marker = 0; marker < 3; ++marker) {
        const auto px =
            geometry::project(bundle.rig[static_cast<std::size_t>(c)], bundle.marker_position(pose, marker));
        bundle.observations.push_back({.camera = c, .wand_pose = p, .marker = marker, .px = px->v});
      }
    }
  }
  solution.residuals.push_back({.camera = 3, .at = {}, .residual_px = {0.1, 0.2}});
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd off(30);
  for (double& value : off) value = normal(random);
  solution.covariance = off * off.transpose();
  return solution;
}

Floor the_room() { return {kRigFromRoom.inverse(), 0.002}; }

TEST(RigEvidence, IsInTheWorldOfTheFloor) {
  const WandSolution solution = tilted_solution();

  const RigEvidence evidence = evidence_of(solution, the_room());

  ASSERT_EQ(evidence.rig.size(), 5U);
  // Rounding of some products of rotations, m.
  EXPECT_LT((evidence.rig[0].centre().v - Vector3d(4.0, 0.0, 2.5)).norm(), 1e-9);
  ASSERT_EQ(evidence.points_m.size(), 2U) << "the second wand pose has no observations";
  EXPECT_LT((evidence.points_m[1] - Vector3d(0.4, 0.1, 1.2)).norm(), 1e-9);
  const auto in_rig = geometry::project(solution.bundle.rig[2], {solution.bundle.wand_poses[2].middle_m});
  const auto in_room = geometry::project(evidence.rig[2], {evidence.points_m[1]});
  ASSERT_TRUE(in_rig && in_room);
  EXPECT_LT((in_rig->v - in_room->v).norm(), 1e-6) << "the images are the same, px";
}

TEST(RigEvidence, HasTheFiguresOfTheSolution) {
  const RigEvidence evidence = evidence_of(tilted_solution(), the_room());

  EXPECT_TRUE(evidence.floor_is_measured);
  EXPECT_EQ(evidence.nominal_length_m, 0.5);
  ASSERT_EQ(evidence.lengths_m.size(), 2U);
  for (const double length_m : evidence.lengths_m) EXPECT_NEAR(length_m, 0.5, 1e-6);
  ASSERT_EQ(evidence.residuals.size(), 1U);
  EXPECT_EQ(evidence.residuals[0].camera, 3);
}

TEST(RigEvidence, HasTheCovarianceInTheAxesOfTheWorld) {
  const WandSolution solution = tilted_solution();

  const RigEvidence evidence = evidence_of(solution, the_room());

  // The variance of a sum over all cameras along the world's x axis, in the axes of the rig and in those of the world.
  const Vector3d x_in_rig = kRigFromRoom.rotation * Vector3d::UnitX();
  Eigen::VectorXd along_rig(30), along_world(30);
  for (Eigen::Index i = 0; i < 10; ++i) {
    along_rig.segment<3>(3 * i) = x_in_rig * static_cast<double>(i + 1);
    along_world.segment<3>(3 * i) = Vector3d::UnitX() * static_cast<double>(i + 1);
  }
  const double expected = along_rig.dot(solution.covariance * along_rig);
  EXPECT_NEAR(along_world.dot(evidence.covariance * along_world) / expected, 1.0, 1e-9);
}

TEST(RigEvidence, IsUprightWithoutAFloorIfTheCamerasHaveOneHeight) {
  const RigEvidence evidence = evidence_of(tilted_solution(), std::nullopt);

  EXPECT_FALSE(evidence.floor_is_measured);
  Vector3d mean = Vector3d::Zero();
  for (const CameraModel& camera : evidence.rig) {
    EXPECT_NEAR(camera.centre().v.z(), 0.0, 1e-9) << "all cameras in one horizontal plane";
    EXPECT_LT(camera.camera_from_world.rotation.row(2).z(), 0.0) << "the cameras look down, not up";
    EXPECT_NEAR(camera.camera_from_world.rotation.determinant(), 1.0, 1e-9) << "not mirrored";
    mean += camera.centre().v / 5.0;
  }
  EXPECT_LT(mean.norm(), 1e-9);
  for (const Vector3d& point : evidence.points_m) EXPECT_LT(point.z(), 0.0) << "the wand is below the cameras";
}

}  // namespace rig_evidence_test
}  // namespace mocap::calibration
