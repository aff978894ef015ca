#include "kinematics/observation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace mocap::kinematics {
namespace observation_test {

TEST(Observation, OfAPointAddsSkinMotionToItsCovariance) {
  const Eigen::Matrix3d covariance = Eigen::Vector3d(9e-6, 16e-6, 0.0).asDiagonal();

  const Observation seen = observe_point(3, {1.0, 2.0, 3.0}, covariance, 0.004);

  const Eigen::Vector3d variances = seen.weight_1_m2.diagonal().cwiseInverse();
  EXPECT_LT((variances - Eigen::Vector3d(25e-6, 32e-6, 16e-6)).norm(), 1e-12);
  EXPECT_TRUE(is_usable(seen));
}

TEST(Observation, OfAPointWithoutAUsableCovarianceIsAMetreUncertain) {
  const Eigen::Matrix3d negative = -Eigen::Matrix3d::Identity();

  const Observation seen = observe_point(0, Eigen::Vector3d::Zero(), negative, 0.003);

  EXPECT_NEAR(seen.sigma_m, 1.0, 1e-5);
  EXPECT_NEAR(information_1_m2(seen), 1.0, 1e-4);
}

TEST(Observation, OfARayHasNoInformationAlongTheRay) {
  const Eigen::Vector3d eye(0.0, -4.0, 1.0), direction = Eigen::Vector3d::UnitY();

  const Observation seen = observe_ray(0, eye, direction, 1e-3, {0.2, 1.0, 1.0}, 0.0);

  EXPECT_LT((seen.position - Eigen::Vector3d(0.0, 1.0, 1.0)).norm(), 1e-12);
  EXPECT_LT((seen.weight_1_m2 * direction).norm(), 1e-9);
  EXPECT_NEAR(seen.sigma_m, 5e-3, 1e-12);  // 1 mrad at 5 m
  EXPECT_NEAR(distance_m(seen, {0.03, 7.0, 1.04}), 0.05, 1e-12);
  EXPECT_NEAR(information_1_m2(seen), 1.0 / (5e-3 * 5e-3), 1e-6);
}

TEST(Observation, IsUnusableWithANumberThatIsNotFinite) {
  Observation seen;
  seen.position.x() = std::numeric_limits<double>::quiet_NaN();

  EXPECT_TRUE(is_usable(Observation{}));
  EXPECT_FALSE(is_usable(seen));
}

}  // namespace observation_test
}  // namespace mocap::kinematics
