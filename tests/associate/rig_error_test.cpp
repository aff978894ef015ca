#include "associate/rig_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace mocap::associate {
namespace rig_error_test {

constexpr std::size_t kViews = 6;
constexpr double kBlob_px = 0.04;

/// Learns from `sets` sets. Each camera has errors with its own sigma, and sometimes a wrong blob.
void learn(RigError& error, const std::vector<double>& sigmas_px, int sets, double wrong, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0.0, 1.0);
  // The residual is smaller than the error, because the point was fitted to the view.
  const double shrinkage = std::sqrt(1.0 - 1.5 / static_cast<double>(kViews));
  for (int set = 0; set < sets; ++set) {
    for (std::size_t camera = 0; camera < sigmas_px.size(); ++camera) {
      const double off_px =
          shrinkage * std::hypot(sigmas_px[camera], kBlob_px) * std::hypot(normal(random), normal(random));
      error.learn(camera, share(random) < wrong ? 1.5 : off_px, kBlob_px, kViews);
    }
  }
}

TEST(RigError, StartsWithTheUpperBoundOfTheSettings) {
  const RigError error(0.5, 4);
  EXPECT_EQ(error.px(), 0.5);
}

TEST(RigError, LearnsTheErrorOfTheViewsWithASafetyFactorOfOneAndAHalf) {
  for (const double sigma_px : {0.08, 0.15, 0.25}) {
    RigError error(0.5, 4);
    learn(error, {sigma_px, sigma_px, sigma_px, sigma_px}, 1000, 0.0, 1);
    // The largest of four estimates with a scatter of 8 %.
    EXPECT_GT(error.px(), 1.4 * sigma_px);
    EXPECT_LT(error.px(), 1.8 * sigma_px);
  }
}

TEST(RigError, ToleratesOneWrongViewInTen) {
  RigError error(0.5, 4);
  learn(error, {0.1, 0.1, 0.1, 0.1}, 1000, 0.1, 2);
  EXPECT_LT(error.px(), 0.22);
}

TEST(RigError, IsTheErrorOfTheWorstCameraAndNeverExceedsTheSettings) {
  RigError error(0.5, 4);
  learn(error, {0.1, 0.1, 0.25, 0.1}, 1000, 0.0, 3);
  EXPECT_GT(error.px(), 0.33);

  learn(error, {0.1, 0.1, 2.0, 0.1}, 1000, 0.0, 4);
  EXPECT_EQ(error.px(), 0.5);
}

/// The rms distance of several views from their common point.
double rms_of(double sigma_px, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, sigma_px);
  double sum = 0.0;
  for (std::size_t i = 0; i < 2 * kViews - 3; ++i) sum += std::pow(normal(random), 2);
  return std::sqrt(sum / static_cast<double>(kViews));
}

TEST(PointError, LearnsTheResidualOfPointsBeyondTheNoiseOfTheirBlobs) {
  for (const double rig_px : {0.1, 0.3}) {
    std::mt19937 random(5);
    PointError error(0.5);
    for (int i = 0; i < 2000; ++i)
      error.learn(rms_of(std::hypot(rig_px, kBlob_px), random), kBlob_px * kBlob_px, kViews);
    // The running median has a scatter of 5 %.
    EXPECT_NEAR(std::sqrt(error.px2()), rig_px, 0.2 * rig_px);
  }
}

TEST(PointError, IsNearlyZeroIfBlobNoiseExplainsTheResiduals) {
  std::mt19937 random(6);
  PointError error(0.5);
  double sum_px2 = 0.0;
  for (int i = 0; i < 2000; ++i) {
    error.learn(rms_of(0.1, random), 0.01, kViews);
    if (i >= 500) sum_px2 += error.px2() / 1500.0;
  }
  EXPECT_LT(sum_px2, 0.15 * 0.01);  // at most 15 % of the variance of the blobs
}

}  // namespace rig_error_test
}  // namespace mocap::associate
