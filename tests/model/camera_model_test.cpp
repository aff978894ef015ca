#include "model/camera_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace mocap {
namespace camera_model_test {

TEST(CameraModel, OfTheIdentityPoseIsAtTheOrigin) { EXPECT_EQ(CameraModel{}.centre().v, Eigen::Vector3d::Zero()); }

TEST(CameraModel, HasItsCentreWhereItsFrameHasTheOrigin) {
  // A worked example: the camera is 2 m above the floor, 3 m from the origin along -y, and looks along +y.
  // Its axes in the world: x right = +x, y down = -z, z along the optical axis = +y.
  const Eigen::Vector3d expected(0.0, -3.0, 2.0);
  CameraModel camera;
  camera.camera_from_world.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  camera.camera_from_world.translation << 0.0, 2.0, 3.0;

  const WorldPoint centre = camera.centre();

  EXPECT_LT((centre.v - expected).norm(), 1e-12);  // rounding, m
  EXPECT_LT((camera.camera_from_world * centre).v.norm(), 1e-12);
  const CameraPoint origin = camera.camera_from_world * WorldPoint{};
  EXPECT_GT(origin.v.z(), 0.0) << "the origin is in front of the camera";
  EXPECT_GT(origin.v.y(), 0.0) << "and in the lower half of the image";
}

}  // namespace camera_model_test
}  // namespace mocap
