#include "associate/rig_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace mocap::associate {
namespace {

constexpr std::size_t kViews = 6;
constexpr double kBlob_px = 0.04;

/// Lets it learn of `sets` sets in which each camera is off by its sigma, and now and then by a wrong blob.
void learn(RigError& error, const std::vector<double>& sigmas_px, int sets, double wrong, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0.0, 1.0);
  // What is left of a view's error when the point has leaned towards it.
  const double lean = std::sqrt(1.0 - 1.5 / static_cast<double>(kViews));
  for (int set = 0; set < sets; ++set) {
    for (std::size_t camera = 0; camera < sigmas_px.size(); ++camera) {
      const double off_px = lean * std::hypot(sigmas_px[camera], kBlob_px) * std::hypot(normal(random), normal(random));
      error.learn(camera, share(random) < wrong ? 1.5 : off_px, kBlob_px, kViews);
    }
  }
}

TEST(RigError, BelievesTheSettingsUntilViewsTellBetter) {
  const RigError error(0.5, 4);
  EXPECT_EQ(error.px(), 0.5);
}

TEST(RigError, LearnsWhatTheViewsAreOffWithHalfAsMuchToSpare) {
  for (const double sigma_px : {0.08, 0.15, 0.25}) {
    RigError error(0.5, 4);
    learn(error, {sigma_px, sigma_px, sigma_px, sigma_px}, 1000, 0.0, 1);
    // The worst of four estimates that scatter by 8 %.
    EXPECT_GT(error.px(), 1.4 * sigma_px);
    EXPECT_LT(error.px(), 1.8 * sigma_px);
  }
}

TEST(RigError, IsNotLedAstrayByAWrongViewInTen) {
  RigError error(0.5, 4);
  learn(error, {0.1, 0.1, 0.1, 0.1}, 1000, 0.1, 2);
  EXPECT_LT(error.px(), 0.22);
}

TEST(RigError, AllowsForTheWorstCameraAndForNoMoreThanTheSettingsDo) {
  RigError error(0.5, 4);
  learn(error, {0.1, 0.1, 0.25, 0.1}, 1000, 0.0, 3);
  EXPECT_GT(error.px(), 0.33);

  learn(error, {0.1, 0.1, 2.0, 0.1}, 1000, 0.0, 4);
  EXPECT_EQ(error.px(), 0.5);
}

/// The root of the mean squared distance of so many views from their common point.
double rms_of(double sigma_px, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, sigma_px);
  double sum = 0.0;
  for (std::size_t i = 0; i < 2 * kViews - 3; ++i) sum += std::pow(normal(random), 2);
  return std::sqrt(sum / static_cast<double>(kViews));
}

TEST(PointError, LearnsWhatPointsAreOffBeyondTheirBlobs) {
  for (const double rig_px : {0.1, 0.3}) {
    std::mt19937 random(5);
    PointError error(0.5);
    for (int i = 0; i < 2000; ++i)
      error.learn(rms_of(std::hypot(rig_px, kBlob_px), random), kBlob_px * kBlob_px, kViews);
    // The running median scatters by 5 %.
    EXPECT_NEAR(std::sqrt(error.px2()), rig_px, 0.2 * rig_px);
  }
}

TEST(PointError, IsNextToNothingWhereTheBlobsTellAll) {
  std::mt19937 random(6);
  PointError error(0.5);
  double sum_px2 = 0.0;
  for (int i = 0; i < 2000; ++i) {
    error.learn(rms_of(0.1, random), 0.01, kViews);
    if (i >= 500) sum_px2 += error.px2() / 1500.0;
  }
  EXPECT_LT(sum_px2, 0.15 * 0.01);  // of the blobs' variance
}

}  // namespace
}  // namespace mocap::associate
