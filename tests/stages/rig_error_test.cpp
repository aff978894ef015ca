#include "stages/rig_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace mocap::stages {
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

}  // namespace
}  // namespace mocap::stages
