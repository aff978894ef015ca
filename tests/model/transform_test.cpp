#include "model/transform.h"

#include <gtest/gtest.h>

namespace mocap {
namespace transform_test {

const Eigen::Matrix3d kTurn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();

TEST(RigidTransform, InverseRestoresAPoint) {
  const CameraFromWorld camera_from_world{kTurn, {0.3, -0.2, 4.0}};
  const WorldPoint point{{1.0, 2.0, 3.0}};

  const WorldPoint back = camera_from_world.inverse() * (camera_from_world * point);

  EXPECT_LT((back.v - point.v).norm(), 1e-12);
}

TEST(Pose, ProductAppliesTheInnerPoseFirst) {
  const Pose outer{{1, 2, 3}, Eigen::Quaterniond(kTurn)};
  const Pose inner{{-4, 5, 6}, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ()))};
  const Eigen::Vector3d point(0.1, 0.2, 0.3);

  EXPECT_LT(((outer * inner) * point - outer * (inner * point)).norm(), 1e-12);
  EXPECT_LT((outer.inverse() * (outer * point) - point).norm(), 1e-12);
}

}  // namespace transform_test
}  // namespace mocap
