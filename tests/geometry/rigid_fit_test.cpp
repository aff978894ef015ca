#include "geometry/rigid_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace mocap::geometry {
namespace rigid_fit_test {

std::vector<PointPair> random_pairs(std::mt19937& random, int count) {
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    pairs.push_back({{normal(random), normal(random), normal(random)}, Eigen::Vector3d::Zero()});
  }
  return pairs;
}

TEST(FitRigid, RecoversAnyRotationAndTranslation) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<PointPair> pairs = random_pairs(random, 3 + trial % 5);
    const Pose truth{
        {1.0, -2.0, 0.1 * trial},
        Eigen::Quaterniond(Eigen::AngleAxisd(0.06 * trial, Eigen::Vector3d(1, 2, trial % 7).normalized()))};
    for (PointPair& pair : pairs) pair.to = truth * pair.from;

    const auto fit = fit_rigid(pairs);

    ASSERT_TRUE(fit);
    EXPECT_LT(fit->rms_m, 1e-9);
    EXPECT_LT((fit->to_from.position - truth.position).norm(), 1e-9);
    EXPECT_GT(std::abs(fit->to_from.rotation.dot(truth.rotation)), 1.0 - 1e-12);
  }
}

TEST(FitRigid, NeverReturnsAReflection) {
  std::mt19937 random(2);
  std::vector<PointPair> pairs = random_pairs(random, 6);
  for (PointPair& pair : pairs) pair.to = {pair.from.x(), -pair.from.y(), pair.from.z()};

  const auto fit = fit_rigid(pairs);

  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->to_from.rotation.toRotationMatrix().determinant(), 1.0, 1e-9);
  EXPECT_GT(fit->rms_m, 0.1);
}

TEST(FitRigid, IgnoresPointsOfWeightZero) {
  std::mt19937 random(3);
  std::vector<PointPair> pairs = random_pairs(random, 5);
  for (PointPair& pair : pairs) pair.to = pair.from + Eigen::Vector3d(1, 0, 0);
  pairs[2].to += Eigen::Vector3d(5, 5, 5);
  pairs[2].weight = 0.0;

  EXPECT_LT(fit_rigid(pairs)->rms_m, 1e-9);
}

TEST(FitRigid, RefusesTooFewPointsAndPointsOnALine) {
  EXPECT_FALSE(fit_rigid({}));
  std::vector<PointPair> line;
  for (int i = 0; i < 5; ++i) line.push_back({{1.0 * i, 2.0 * i, 0.0}, {1.0 * i, 2.0 * i, 0.0}});
  EXPECT_FALSE(fit_rigid(line));
  EXPECT_FALSE(fit_rigid(std::vector<PointPair>(4, PointPair{{1, 1, 1}, {2, 2, 2}})));
}

TEST(FitUpright, RecoversYawScaleAndTranslation) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<PointPair> pairs = random_pairs(random, 6);
    const UprightFit truth{-3.0 + 0.1 * trial, 0.8 + 0.01 * trial, {1.0, 2.0, -0.5}};
    for (PointPair& pair : pairs) pair.to = truth * pair.from;

    const auto fit = fit_upright(pairs);

    ASSERT_TRUE(fit);
    EXPECT_LT(fit->rms_m, 1e-9);
    EXPECT_NEAR(fit->yaw_rad, truth.yaw_rad, 1e-9);
    EXPECT_NEAR(fit->scale, truth.scale, 1e-9);
  }
}

TEST(FitUpright, RefusesAVerticalLine) {
  std::vector<PointPair> line;
  for (int i = 0; i < 5; ++i) line.push_back({{1.0, 2.0, 1.0 * i}, {0.0, 0.0, 1.0 * i}});

  EXPECT_FALSE(fit_upright(line));
}

}  // namespace rigid_fit_test
}  // namespace mocap::geometry
