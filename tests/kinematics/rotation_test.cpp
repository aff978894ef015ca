#include "kinematics/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "kinematics/algebra.h"

namespace mocap::kinematics {
namespace rotation_test {

TEST(CrossMatrix, TimesAVectorIsTheCrossProduct) {
  const Eigen::Vector3d a(1.0, -2.0, 3.0), b(-0.5, 4.0, 2.5);

  EXPECT_EQ(cross_matrix(a) * b, a.cross(b));
}

TEST(SameHemisphere, GivesTheSameRotationWithTheNearerSign) {
  const Eigen::Quaterniond last = from_rotation_vector({0.0, 0.0, 3.0});
  const Eigen::Quaterniond next = from_rotation_vector({0.0, 0.0, -3.0});  // 16 degrees further on, with the other sign

  const Eigen::Quaterniond q = same_hemisphere(next, last);

  EXPECT_GT(q.dot(last), 0.9);
  EXPECT_LT((q.toRotationMatrix() - next.toRotationMatrix()).norm(), 1e-12);
}

TEST(RotationBetween, IsTheShortestRotationFromOneDirectionToAnother) {
  std::mt19937 random(3);
  std::normal_distribution<double> any;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d from(any(random), any(random), any(random)), to(any(random), any(random), any(random));

    const Eigen::Quaterniond rotation = rotation_between(from, to);

    EXPECT_NEAR(rotation.norm(), 1.0, 1e-12);
    EXPECT_LT((rotation * from.normalized() - to.normalized()).norm(), 1e-12);
    const double angle = std::acos(from.normalized().dot(to.normalized()));
    EXPECT_NEAR(rotation_vector(rotation).norm(), angle, 1e-7);
  }
}

TEST(RotationBetween, TakesADirectionToNearlyItsOpposite) {
  const Eigen::Vector3d from(0.3, -2.0, 0.7);
  for (const double off : {0.0, 1e-16, 1e-9, 1e-7, 1e-5, 1e-3}) {
    const Eigen::Vector3d to = -5.0 * from + off * Eigen::Vector3d(1.0, 2.0, -1.0);

    const Eigen::Quaterniond rotation = rotation_between(from, to);

    EXPECT_NEAR(rotation.norm(), 1.0, 1e-9) << off;
    EXPECT_LT((rotation * from.normalized() - to.normalized()).norm(), 1e-5) << off;
    EXPECT_NEAR(rotation_vector(rotation).norm(), std::numbers::pi, 1e-2) << off;
  }
}

}  // namespace rotation_test
}  // namespace mocap::kinematics
