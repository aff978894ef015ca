#include "calibration/lens/lens_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/board_images.h"

namespace mocap::calibration {
namespace lens_quality_test {

using support::BoardImages;

constexpr int kWidth_px = 1280;
constexpr int kHeight_px = 1024;
constexpr double kNoise_px = 0.1;
const Board kBoard{BoardKind::Charuco, 9, 7, 0.05, 0.038, "4x4_50"};
const Lens kLens{LensKind::Pinhole, 1100.0, 1100.0, 639.5, 511.5, {}};

IntrinsicMask focal_and_centre() {
  IntrinsicMask mask = IntrinsicMask::Constant(false);
  mask.head<4>() = true;
  return mask;
}

// Views of boards in the middle of the image.
LensBundle some_boards(double noise_px) {
  const BoardImages images(kLens, kWidth_px, kHeight_px, kBoard);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  LensBundle bundle{kLens, {}, {}};
  for (int i = 0; i < 15; ++i) {
    const Eigen::Vector2d px(640.0 + 200.0 * unit(random), 512.0 + 150.0 * unit(random));
    const CameraFromWorld pose = images.pose(px, 1.0 + 0.2 * unit(random), 0.6 * std::abs(unit(random)), random);
    bundle.views.push_back(images.view(pose, noise_px, random));
    bundle.camera_from_board.push_back(pose);
  }
  return bundle;
}

TEST(LensBundle, EstimatesTheExactPoseOfABoard) {
  const LensBundle bundle = some_boards(0.0);

  const auto pose = estimate_board_pose(bundle.views[3], kLens);

  ASSERT_TRUE(pose);
  EXPECT_LT((pose->rotation - bundle.camera_from_board[3].rotation).norm(), 1e-6);
  EXPECT_LT((pose->translation - bundle.camera_from_board[3].translation).norm(), 1e-6);  // m
}

TEST(LensBundle, RecoversAPerturbedFocalLength) {
  LensBundle bundle = some_boards(0.0);
  bundle.lens.fx_px = bundle.lens.fy_px = 1150.0;

  const LensResidual residual = adjust_lens(bundle, focal_and_centre(), 60);

  EXPECT_NEAR(bundle.lens.fx_px, 1100.0, 1e-3);
  EXPECT_LT(residual.rms_px(), 1e-4);
}

TEST(LensQuality, CrossValidationMeasuresTheNoise) {
  LensBundle bundle = some_boards(kNoise_px);
  adjust_lens(bundle, focal_and_centre(), 60);

  EXPECT_NEAR(cross_validate(bundle, focal_and_centre()), kNoise_px, 0.15 * kNoise_px);
}

TEST(LensQuality, UncertaintyGrowsTowardsTheImageCorners) {
  LensBundle bundle = some_boards(kNoise_px);
  adjust_lens(bundle, focal_and_centre(), 60);
  const auto covariance = lens_covariance(bundle, focal_and_centre());
  ASSERT_TRUE(covariance);

  const MappingUncertainty uncertainty = mapping_uncertainty(bundle, *covariance, kWidth_px, kHeight_px, 0.5);

  EXPECT_GT(uncertainty.corner_px, uncertainty.rim_px);
  EXPECT_GT(uncertainty.rim_px, 0.0);
}

}  // namespace lens_quality_test
}  // namespace mocap::calibration
