// The steps of a fit. fit_lens_test.cpp has the fit as a whole and the derivative pixel_jacobian.
#include "calibration/lens/lens_bundle.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "support/board_images.h"

namespace mocap::calibration {
namespace lens_bundle_test {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Board kBoard{BoardKind::Charuco, 9, 7, 0.05, 0.038, "4x4_50"};

Lens true_lens() {
  Lens lens{LensKind::Pinhole, 1105.0, 1101.0, 652.0, 500.0, {}};
  lens.distortion << -0.21, 0.09, 6e-4, -4e-4, 0.0;
  return lens;
}

IntrinsicVector values_of(const Lens& lens) {
  IntrinsicVector values;
  values << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion;
  return values;
}

IntrinsicMask all_but_k3() {
  IntrinsicMask mask = IntrinsicMask::Constant(true);
  mask[8] = false;
  return mask;
}

/// Exact views of tilted boards in an image of 1280 x 1024 px.
LensBundle exact_bundle(int boards, std::uint32_t seed) {
  const support::BoardImages images(true_lens(), 1280, 1024, kBoard);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  LensBundle bundle{true_lens(), {}, {}};
  while (static_cast<int>(bundle.views.size()) < boards) {
    const Vector2d px(640.0 + 400.0 * unit(random), 512.0 + 320.0 * unit(random));
    const CameraFromWorld pose = images.pose(px, 0.9 + 0.2 * unit(random), 0.7 * std::abs(unit(random)), random);
    const BoardView view = images.view(pose, 0.0, random);
    if (view.seen_px.size() < 20) continue;
    bundle.views.push_back(view);
    bundle.camera_from_board.push_back(pose);
  }
  return bundle;
}

CameraFromWorld turned(const CameraFromWorld& pose, const Vector3d& turn_rad) {
  return {Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()).toRotationMatrix() * pose.rotation,
          pose.translation};
}

TEST(AdjustLens, RecoversThePerturbedLensAndPosesFromExactCorners) {
  LensBundle bundle = exact_bundle(12, 1);
  const LensBundle truth = bundle;
  bundle.lens.fx_px *= 1.05;
  bundle.lens.fy_px *= 0.97;
  bundle.lens.cx_px += 15.0;
  bundle.lens.distortion.setZero();
  for (CameraFromWorld& pose : bundle.camera_from_board) {
    pose = turned(pose, {0.02, -0.03, 0.01});
    pose.translation += Vector3d(0.01, -0.01, 0.02);
  }

  const LensResidual residual = adjust_lens(bundle, all_but_k3(), 100);

  // The iterations stop when the cost decreases by less than 1e-11 of itself: residuals of far less than a noise of
  // 0.05 px.
  EXPECT_LT(residual.rms_px(), 1e-4);
  EXPECT_LT((values_of(bundle.lens) - values_of(truth.lens)).head<4>().norm(), 0.05);  // px
  EXPECT_LT((bundle.lens.distortion - truth.lens.distortion).norm(), 1e-3);
  EXPECT_EQ(residual.view_rms_px.size(), 12U);
}

TEST(AdjustLens, LeavesConstantParametersAsTheyAre) {
  LensBundle bundle = exact_bundle(6, 2);
  bundle.lens.fx_px *= 1.02;
  bundle.lens.cx_px += 5.0;
  IntrinsicMask only_fx = IntrinsicMask::Constant(false);
  only_fx[0] = true;
  const IntrinsicVector before = values_of(bundle.lens);

  adjust_lens(bundle, only_fx, 30);

  EXPECT_NE(bundle.lens.fx_px, before[0]);
  EXPECT_EQ(values_of(bundle.lens).tail<8>(), before.tail<8>());
}

TEST(RefitBoardPoses, FindsThePosesOfATrueLens) {
  LensBundle bundle = exact_bundle(5, 3);
  const LensBundle truth = bundle;
  for (CameraFromWorld& pose : bundle.camera_from_board) pose = turned(pose, {-0.05, 0.02, 0.04});

  const LensResidual residual = refit_board_poses(bundle);

  EXPECT_LT(residual.rms_px(), 1e-4);
  EXPECT_EQ(values_of(bundle.lens), values_of(truth.lens));
  for (std::size_t v = 0; v < 5; ++v) {
    EXPECT_LT((bundle.camera_from_board[v].translation - truth.camera_from_board[v].translation).norm(), 1e-6);  // m
  }
}

// The oracle inverts the normal matrix of all unknowns, with derivatives by finite differences.
TEST(LensCovariance, EqualsThatOfTheWholeNormalMatrix) {
  const LensBundle bundle = exact_bundle(4, 4);
  const IntrinsicMask mask = all_but_k3();
  constexpr int kLens = 8;
  const auto pixels = [&](const Eigen::VectorXd& step) {
    Lens lens = bundle.lens;
    lens.fx_px += step[0];
    lens.fy_px += step[1];
    lens.cx_px += step[2];
    lens.cy_px += step[3];
    lens.distortion.head<4>() += step.segment<4>(4);
    std::vector<double> values;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
      const Eigen::Index first = kLens + 6 * static_cast<Eigen::Index>(v);
      CameraFromWorld pose = bundle.camera_from_board[v];
      const Vector3d turn = step.segment<3>(first);
      if (turn.norm() > 0.0) pose = turned(pose, turn);
      pose.translation += step.segment<3>(first + 3);
      for (const Vector2d& corner : bundle.views[v].board_m) {
        const Vector3d at = pose.rotation * Vector3d(corner.x(), corner.y(), 0.0) + pose.translation;
        const PixelPoint px = geometry::distort(lens, {at.head<2>() / at.z()});
        values.push_back(px.v.x());
        values.push_back(px.v.y());
      }
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
  };
  const Eigen::Index unknowns = kLens + 6 * 4;
  const Eigen::Index rows = pixels(Eigen::VectorXd::Zero(unknowns)).size();
  Eigen::MatrixXd jacobian(rows, unknowns);
  for (Eigen::Index i = 0; i < unknowns; ++i) {
    const double h = i < 4 ? 1e-3 : 1e-6;  // px, else coefficients, rad and m
    const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(unknowns, i);
    jacobian.col(i) = (pixels(step) - pixels(-step)) / (2.0 * h);
  }
  const Eigen::MatrixXd expected = (jacobian.transpose() * jacobian).inverse();

  const auto covariance = lens_covariance(bundle, mask);

  ASSERT_TRUE(covariance);
  for (int i = 0; i < kLens; ++i) {
    // Finite differences of a matrix with a condition of 1e12 or so: a relative error of 1e-3.
    EXPECT_NEAR((*covariance)(i, i) / expected(i, i), 1.0, 1e-3) << i;
  }
  EXPECT_EQ((*covariance)(8, 8), 0.0) << "constant";
}

TEST(LensCovariance, IsNothingIfOneFrontalBoardIsSeen) {
  // Focal length and distance of a frontal board are the same: no view determines them.
  const support::BoardImages images(true_lens(), 1280, 1024, kBoard);
  std::mt19937 random(5);
  LensBundle bundle{true_lens(), {}, {}};
  CameraFromWorld pose = images.pose({640.0, 512.0}, 1.0, 0.0, random);
  bundle.views.push_back(images.view(pose, 0.0, random));
  bundle.camera_from_board.push_back(pose);

  EXPECT_FALSE(lens_covariance(bundle, all_but_k3()));
}

TEST(EstimateBoardPose, FindsThePoseOfExactCorners) {
  const LensBundle truth = exact_bundle(8, 6);

  for (std::size_t v = 0; v < truth.views.size(); ++v) {
    const auto pose = estimate_board_pose(truth.views[v], truth.lens);

    ASSERT_TRUE(pose);
    // Rays are exact to 1e-9 on the image plane at 1 m.
    EXPECT_LT((pose->translation - truth.camera_from_board[v].translation).norm(), 1e-5) << v;
    EXPECT_LT((pose->rotation - truth.camera_from_board[v].rotation).norm(), 1e-4) << v;
  }
}

TEST(EstimateBoardPose, NeedsSixCorners) {
  const LensBundle bundle = exact_bundle(1, 7);
  BoardView view;
  for (const std::size_t i : {0U, 4U, 9U, 14U, 19U}) {  // not on one line
    view.seen_px.push_back(bundle.views[0].seen_px[i]);
    view.board_m.push_back(bundle.views[0].board_m[i]);
  }

  EXPECT_FALSE(estimate_board_pose(view, true_lens()));
}

TEST(LensResidual, IsTheRootOfTheMeanSquarePerAxis) {
  EXPECT_EQ(LensResidual{}.rms_px(), 0.0);
  EXPECT_DOUBLE_EQ((LensResidual{.sum_px2 = 8.0, .points = 1, .view_rms_px = {}}.rms_px()), 2.0);
}

}  // namespace lens_bundle_test
}  // namespace mocap::calibration
