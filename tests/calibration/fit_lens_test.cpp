#include "calibration/lens/fit_lens.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "support/board_images.h"

namespace mocap::calibration {
namespace fit_lens_test {

using support::BoardImages;
using testing::HasSubstr;

constexpr int kWidth_px = 1280;
constexpr int kHeight_px = 1024;
constexpr double kNoise_px = 0.08;
const Board kBoard{BoardKind::Charuco, 9, 7, 0.05, 0.038, "4x4_50"};

Lens pinhole(double k3 = 0.0) {
  Lens lens{LensKind::Pinhole, 1105.0, 1101.0, 652.0, 500.0, {}};
  lens.distortion << -0.21, 0.09, 6e-4, -4e-4, k3;
  return lens;
}

Lens fisheye() {
  Lens lens{LensKind::Fisheye, 520.0, 521.5, 635.0, 515.0, {}};
  lens.distortion << 0.035, -0.012, 0.004, -0.0009, 0.0;
  return lens;
}

struct Shown {
  int boards = 30;
  double tilt_rad = 0.7;
  double reach = 1.0;       // part of the image in which the centres of the boards are
  double distance_m = 0.0;  // 0: a board fills about a third of the image
};

std::vector<BoardView> show(const Lens& lens, const Shown& shown, std::uint32_t seed) {
  const BoardImages images(lens, kWidth_px, kHeight_px, kBoard);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<BoardView> views;
  while (static_cast<int>(views.size()) < shown.boards) {
    const Eigen::Vector2d px(0.5 * kWidth_px * (1.0 + 0.95 * shown.reach * unit(random)),
                             0.5 * kHeight_px * (1.0 + 0.95 * shown.reach * unit(random)));
    const double distance =
        shown.distance_m > 0.0 ? shown.distance_m : lens.fx_px / 1100.0 * (0.9 + 0.3 * unit(random));
    const double tilt = shown.tilt_rad * std::sqrt(std::abs(unit(random)));
    const BoardView view = images.view(images.pose(px, distance, tilt, random), kNoise_px, random);
    if (view.seen_px.size() >= 10) views.push_back(view);
  }
  return views;
}

IntrinsicVector values_of(const Lens& lens) {
  IntrinsicVector values;
  values << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion;
  return values;
}

TEST(FitLens, EstimatesTheLensWithinItsOwnUncertainty) {
  for (const Lens& truth : {pinhole(), fisheye()}) {
    double squares = 0.0;
    int count = 0;
    for (std::uint32_t seed = 1; seed <= 8; ++seed) {
      const auto fit = fit_lens(show(truth, {}, seed), kWidth_px, kHeight_px, truth.kind);

      ASSERT_TRUE(fit) << fit.error().message;
      EXPECT_NEAR(fit->rms_px, kNoise_px, 0.1 * kNoise_px);
      EXPECT_NEAR(fit->heldout_px, kNoise_px, 0.15 * kNoise_px);
      for (int i = 0; i < 4; ++i) {
        const double off = (values_of(fit->lens)[i] - values_of(truth)[i]) / fit->sigma[i];
        EXPECT_LT(std::abs(off), 5.0) << i;
        squares += off * off;
        ++count;
      }
    }
    // 32 correlated values: the rms of the normalised errors is 1 to a third.
    EXPECT_NEAR(std::sqrt(squares / count), 1.0, 0.34);
  }
}

// A ray after a small rotation of the camera.
Eigen::Vector2d turned(const Eigen::Vector2d& ray, const Eigen::Vector3d& turn_rad) {
  const Eigen::Vector3d d(ray.x(), ray.y(), 1.0);
  const Eigen::Vector3d moved = d + turn_rad.cross(d);
  return moved.head<2>() / moved.z();
}

// Errors of the pixels of an 11 x 11 grid of rays after the rotation of the camera that compensates best (the extrinsic
// calibration does that). The outermost points of the grid are the image border.
Eigen::MatrixX2d errors_px(const Lens& truth, const Lens& found) {
  Eigen::MatrixX2d errors(121, 2);
  Eigen::Matrix<double, Eigen::Dynamic, 3> slopes(242, 3);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (int i = 0; i < 121; ++i) {
    const PixelPoint px{{(kWidth_px - 1) * 0.1 * (i % 11), (kHeight_px - 1) * 0.1 * (i / 11)}};
    const Eigen::Vector2d ray = geometry::undistort(truth, px)->v;
    errors.row(i) = (px.v - geometry::distort(found, {ray}).v).transpose();
    constexpr double kStep_rad = 1e-6;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector2d moved = geometry::distort(found, {turned(ray, kStep_rad * Eigen::Vector3d::Unit(axis))}).v;
      slopes.block<2, 1>(2 * i, axis) = (moved - geometry::distort(found, {ray}).v) / kStep_rad;
    }
    const bool at_rim = i % 11 == 0 || i % 11 == 10 || i / 11 == 0 || i / 11 == 10;
    if (at_rim) continue;
    const auto slope = slopes.middleRows<2>(2 * i);
    normal += slope.transpose() * slope;
    rhs += slope.transpose() * errors.row(i).transpose();
  }
  const Eigen::Vector3d turn = normal.inverse() * rhs;
  for (int i = 0; i < 121; ++i) errors.row(i) -= (slopes.middleRows<2>(2 * i) * turn).transpose();
  return errors;
}

TEST(FitLens, RaysAreAccurateInTheWholeImage) {
  for (const Lens& truth : {pinhole(0.12), fisheye()}) {
    const auto fit = fit_lens(show(truth, {.boards = 40}, 3), kWidth_px, kHeight_px, truth.kind);
    ASSERT_TRUE(fit) << fit.error().message;

    const Eigen::MatrixX2d errors = errors_px(truth, fit->lens);

    EXPECT_LT(fit->rim_sigma_px, 3.0 * kNoise_px);  // few boards are seen near the border of a fisheye image
    for (const int corner : {0, 10, 110, 120}) {
      EXPECT_LT(errors.row(corner).norm(), 4.0 * std::sqrt(2.0) * fit->corner_sigma_px) << corner;
    }
    for (int i = 0; i < 121; ++i) {
      const bool at_rim = i % 11 == 0 || i % 11 == 10 || i / 11 == 0 || i / 11 == 10;
      if (!at_rim) {
        EXPECT_LT(errors.row(i).norm(), 4.0 * std::sqrt(2.0) * fit->rim_sigma_px) << i;
      }
    }
  }
}

TEST(FitLens, EstimatesTheLastTermOnlyIfBoardsDetermineIt) {
  const auto without = fit_lens(show(pinhole(0.0), {}, 5), kWidth_px, kHeight_px, LensKind::Pinhole);
  const auto with = fit_lens(show(pinhole(0.25), {.boards = 40}, 5), kWidth_px, kHeight_px, LensKind::Pinhole);
  const auto inside =
      fit_lens(show(pinhole(0.25), {.boards = 40, .reach = 0.25}, 5), kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_TRUE(without);
  EXPECT_FALSE(without->estimated[8]);
  EXPECT_EQ(without->lens.distortion[4], 0.0);
  EXPECT_THAT(without->not_estimated, testing::Contains(HasSubstr("k3: does not explain more than noise")));
  ASSERT_TRUE(with);
  EXPECT_TRUE(with->estimated[8]);
  EXPECT_NEAR(with->lens.distortion[4], 0.25, 5.0 * with->sigma[8]);
  ASSERT_TRUE(inside) << inside.error().message;
  EXPECT_LT(inside->coverage.reach, 0.75);
  EXPECT_THAT(inside->not_estimated, testing::Contains(HasSubstr("k3: boards reach only")));
}

TEST(FitLens, ALastTermOutOfReachDoesNotEndTheSelection) {
  Lens lens = pinhole(1.0);
  lens.distortion[2] = 3e-4;
  lens.distortion[3] = -3e-4;

  const auto fit = fit_lens(show(lens, {.boards = 40, .reach = 0.25}, 5), kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_THAT(fit->not_estimated, testing::ElementsAre(HasSubstr("k3: boards reach only")));
  EXPECT_TRUE(fit->estimated[6]) << "the tangential term is smaller than k3, and significant";
}

TEST(FitLens, ReportsLargerUncertaintyWhereNoBoardWasSeen) {
  const auto wide = fit_lens(show(pinhole(), {}, 6), kWidth_px, kHeight_px, LensKind::Pinhole);
  const auto inside = fit_lens(show(pinhole(), {.reach = 0.3}, 6), kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_TRUE(wide);
  ASSERT_TRUE(inside) << inside.error().message;
  EXPECT_GT(inside->corner_sigma_px, 3.0 * wide->corner_sigma_px);
  EXPECT_GT(inside->corner_sigma_px, 2.0 * inside->rim_sigma_px);
}

TEST(FitLens, RefusesParallelBoards) {
  const auto fit =
      fit_lens(show(pinhole(), {.tilt_rad = 0.05, .distance_m = 1.0}, 7), kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_FALSE(fit);
  EXPECT_THAT(fit.error().message, HasSubstr("focal length is not determined"));
  EXPECT_THAT(fit.error().message, HasSubstr("tilt the board"));
}

TEST(FitLens, RefusesTooFewBoardsAndAnEmptyImageBorder) {
  const auto few = fit_lens(show(pinhole(), {.boards = 4}, 8), kWidth_px, kHeight_px, LensKind::Pinhole);
  const auto inside =
      fit_lens(show(pinhole(), {.reach = 0.05, .distance_m = 1.6}, 8), kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message, HasSubstr("found in 4 images"));
  ASSERT_FALSE(inside);
  EXPECT_THAT(inside.error().message, HasSubstr("show the board near the image border"));
}

TEST(FitLens, LeavesOutAnInconsistentBoard) {
  std::vector<BoardView> views = show(pinhole(), {}, 9);
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, 3.0);
  for (Eigen::Vector2d& px : views[11].seen_px) px += Eigen::Vector2d(noise(random), noise(random));

  const auto fit = fit_lens(views, kWidth_px, kHeight_px, LensKind::Pinhole);

  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->left_out, testing::ElementsAre(11u));
  EXPECT_NEAR(fit->rms_px, kNoise_px, 0.1 * kNoise_px);
}

TEST(FitLens, ThePixelJacobianEqualsFiniteDifferences) {
  for (const Lens& lens : {pinhole(0.1), fisheye()}) {
    const Eigen::Vector2d ray(0.31, -0.22);
    const auto slopes = pixel_jacobian(lens, ray);
    for (int i = 0; i < kIntrinsicCount; ++i) {
      const double step = i < 4 ? 1e-3 : 1e-6;
      const auto pixel = [&](double by) {
        Lens moved = lens;
        IntrinsicVector values = values_of(lens);
        values[i] += by;
        moved.fx_px = values[0];
        moved.fy_px = values[1];
        moved.cx_px = values[2];
        moved.cy_px = values[3];
        moved.distortion = values.tail<5>();
        return geometry::distort(moved, {ray}).v;
      };
      const Eigen::Vector2d difference = (pixel(step) - pixel(-step)) / (2.0 * step);
      EXPECT_LT((slopes.col(i) - difference).norm(), 1e-6 * (1.0 + difference.norm()))
          << i;  // the rounding error divided by the step
    }
  }
}

}  // namespace fit_lens_test
}  // namespace mocap::calibration
