#include "pose/depth_gaussian_sum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mocap::pose {
namespace depth_gaussian_sum_test {

constexpr double kStep_s = 1.0 / 120.0;
constexpr double kSigma_m2 = 2.0 * 0.25 * 5e-5;  // reach 25 cm, standard deviation 0.05 mm
const Eigen::Vector3d kRay = Eigen::Vector3d::UnitX();

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set * kStep_s); }

// The state after half a second of a motion `depth_m` (a function of time, s), of which only the square is measured,
// with noise.
template <class Depth>
DepthGaussianSum after_motion(const Depth& depth_m, int sets = 60) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise_m2(0.0, kSigma_m2);
  DepthGaussianSum ray;
  ray.begin(at(0), kRay, depth_m(0.0));
  for (int set = 1; set <= sets; ++set) {
    const double m = depth_m(set * kStep_s);
    ray.update(at(set), kRay, m * m + noise_m2(random), kSigma_m2);
    ray.commit(at(set));
  }
  return ray;
}

TEST(DepthGaussianSum, CrossesTheTangentPointAtConstantVelocity) {
  const DepthGaussianSum ray = after_motion([](double t_s) { return -0.1 + 0.4 * t_s; });

  EXPECT_LT(ray.cost(DepthGaussianSum::Far), 0.1);
  EXPECT_GT(ray.cost(DepthGaussianSum::Near), 4.0);
}

TEST(DepthGaussianSum, FollowsAnOscillationThroughTheTangentPoint) {
  const DepthGaussianSum ray = after_motion([](double t_s) { return 0.06 * std::cos(12.6 * t_s); });

  EXPECT_LT(ray.cost(DepthGaussianSum::Far), 0.1);
  EXPECT_GT(ray.cost(DepthGaussianSum::Near), 4.0);
}

TEST(DepthGaussianSum, TurnsBackBeforeTheTangentPoint) {
  const DepthGaussianSum ray = after_motion([](double t_s) { return -0.065 - 0.045 * std::cos(12.6 * t_s); });

  EXPECT_LT(ray.cost(DepthGaussianSum::Near), 0.1);
  EXPECT_GT(ray.cost(DepthGaussianSum::Far), 4.0);
}

// Without motion the measurements of both branches are equal, but the state does not leave its branch.
TEST(DepthGaussianSum, KeepsTheBranchOfAMarkerAtRest) {
  const DepthGaussianSum ray = after_motion([](double) { return 0.08; });

  EXPECT_LT(ray.cost(DepthGaussianSum::Far), 0.1);
  EXPECT_GT(ray.cost(DepthGaussianSum::Near), 4.0);
}

TEST(DepthGaussianSum, IsAmbiguousForAMarkerAtRestAtTheTangentPoint) {
  const DepthGaussianSum ray = after_motion([](double) { return -0.001; });

  EXPECT_LT(ray.cost(DepthGaussianSum::Near), 1.0);
  EXPECT_LT(ray.cost(DepthGaussianSum::Far), 1.0);
}

TEST(DepthGaussianSum, IgnoresUpdatesThatWereNotCommitted) {
  DepthGaussianSum ray = after_motion([](double t_s) { return -0.1 + 0.4 * t_s; });
  DepthGaussianSum same = ray;

  ray.update(at(61), kRay, 0.04, kSigma_m2);
  ray.update(at(61), kRay, 0.0121, kSigma_m2);
  same.update(at(61), kRay, 0.0121, kSigma_m2);

  EXPECT_EQ(ray.cost(DepthGaussianSum::Near), same.cost(DepthGaussianSum::Near));
}

TEST(DepthGaussianSum, FollowsOneRayForATenthOfASecond) {
  const DepthGaussianSum ray = after_motion([](double) { return 0.08; });

  EXPECT_TRUE(ray.follows(kRay, at(61)));
  EXPECT_FALSE(ray.follows(Eigen::Vector3d::UnitY(), at(61)));
  EXPECT_FALSE(ray.follows(kRay, at(75)));
}

}  // namespace depth_gaussian_sum_test
}  // namespace mocap::pose
