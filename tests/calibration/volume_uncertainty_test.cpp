// Worked examples and the grid. assess_rig_test.cpp propagates errors of a rig.
#include "calibration/rig/volume_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace mocap::calibration {
namespace volume_uncertainty_test {

using Eigen::Vector3d;

constexpr double kFocal_px = 1000.0;

/// A camera at `from_m` without distortion that looks horizontally at `to_m`.
CameraModel looking(const Vector3d& from_m, const Vector3d& to_m) {
  CameraModel camera;
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.lens.fx_px = camera.lens.fy_px = kFocal_px;
  camera.lens.cx_px = 639.5;
  camera.lens.cy_px = 511.5;
  const Vector3d forward = (to_m - from_m).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  camera.camera_from_world.rotation.row(0) = right;
  camera.camera_from_world.rotation.row(1) = forward.cross(right);
  camera.camera_from_world.rotation.row(2) = forward;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * from_m);
  return camera;
}

const Vector3d kPoint(0.3, -0.2, 1.0);

TEST(PositionSigma, OfTwoCamerasAtARightAngleIsComputedByHand) {
  const Rig rig{looking(kPoint + Vector3d(-2.0, 0.0, 0.0), kPoint), looking(kPoint + Vector3d(0.0, -2.0, 0.0), kPoint)};
  // Each camera measures the two axes across its optical axis to 0.1 px * 2 m / 1000 px. Both measure z, which halves
  // the variance of z: the sum of the three variances is 2.5 of one.
  const double expected_m = 0.1 * 2.0 / kFocal_px * std::sqrt(2.5);

  const auto sigma_m = position_sigma_m(rig, {}, 0.1, kPoint);

  ASSERT_TRUE(sigma_m);
  EXPECT_NEAR(*sigma_m, expected_m, 1e-12);
}

TEST(PositionSigma, IncludesTheUncertaintyOfTheRig) {
  const Rig rig{looking(kPoint + Vector3d(-2.0, 0.0, 0.0), kPoint), looking(kPoint + Vector3d(0.0, -2.0, 0.0), kPoint)};
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(12, 12);
  covariance(1, 1) = 1e-6;  // the first camera, which measures y, is uncertain by 1 mm along y

  const auto sigma_m = position_sigma_m(rig, covariance, 1e-9, kPoint);

  ASSERT_TRUE(sigma_m);
  EXPECT_NEAR(*sigma_m, 1e-3, 1e-9);
}

TEST(PositionSigma, IsNothingIfOneCameraSeesThePoint) {
  const Rig one{looking(kPoint + Vector3d(-2.0, 0.0, 0.0), kPoint)};
  const Rig other_way{one[0], looking(kPoint + Vector3d(0.0, -2.0, 0.0), kPoint - Vector3d(0.0, 4.0, 0.0))};

  EXPECT_FALSE(position_sigma_m(one, {}, 0.1, kPoint));
  EXPECT_FALSE(position_sigma_m(other_way, {}, 0.1, kPoint)) << "the second camera looks away";
}

TEST(PositionSigma, IsNothingIfTheRaysAreNearlyParallel) {
  const Vector3d far = kPoint + Vector3d(-5.0, 0.0, 0.0);
  const auto sigma_of = [&](double base_m) {
    return position_sigma_m({looking(far, kPoint), looking(far + Vector3d(0.0, base_m, 0.0), kPoint)}, {}, 1.0, kPoint);
  };

  // The depth is uncertain by sqrt(2) * 5 m * 5 m / (1000 * base): 35 m for 1 mm and 3.5 m for 10 mm.
  EXPECT_FALSE(sigma_of(0.001));
  ASSERT_TRUE(sigma_of(0.01));
  EXPECT_NEAR(*sigma_of(0.01), 3.54, 0.02);
}

std::vector<Vector3d> points_in_a_box(std::size_t count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(2.0 * unit(random), unit(random), 0.5 + unit(random));
  return points;
}

const Rig kRig{looking({-3.0, 0.5, 1.0}, {1.0, 0.5, 1.0}), looking({1.0, -3.0, 1.0}, {1.0, 0.5, 1.0})};

TEST(VolumeUncertainty, HasTheSigmaOfEachPointOfItsGrid) {
  const auto volume = volume_uncertainty(points_in_a_box(2000), kRig, {}, 0.1);

  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->columns, 28) << "along the longer side";
  EXPECT_NEAR(volume->rows, 14, 1);
  ASSERT_EQ(volume->heights_m.size(), volume->sigma_m.size());
  const Vector3d size_m = volume->to_m - volume->from_m;
  std::vector<double> seen;
  std::size_t unseen = 0;
  for (std::size_t slice = 0; slice < volume->heights_m.size(); ++slice) {
    ASSERT_EQ(volume->sigma_m[slice].size(), static_cast<std::size_t>(volume->columns * volume->rows));
    for (int row = 0; row < volume->rows; ++row) {
      for (int column = 0; column < volume->columns; ++column) {
        const Vector3d middle_m(volume->from_m.x() + (column + 0.5) * size_m.x() / volume->columns,
                                volume->from_m.y() + (row + 0.5) * size_m.y() / volume->rows, volume->heights_m[slice]);
        const double sigma_m = volume->sigma_m[slice][static_cast<std::size_t>(row * volume->columns + column)];
        const auto expected_m = position_sigma_m(kRig, {}, 0.1, middle_m);
        EXPECT_EQ(std::isfinite(sigma_m), expected_m.has_value());
        if (expected_m) {
          EXPECT_NEAR(sigma_m, *expected_m, 1e-12);
        }
        if (expected_m) seen.push_back(sigma_m);
        if (!expected_m) ++unseen;
      }
    }
  }
  std::ranges::sort(seen);
  ASSERT_FALSE(seen.empty());
  EXPECT_NEAR(volume->unseen_fraction, static_cast<double>(unseen) / static_cast<double>(unseen + seen.size()), 1e-12);
  // Neighbours of the quantile in the sorted list, whichever way the index is rounded.
  ASSERT_TRUE(volume->median_m && volume->p90_m);
  EXPECT_GE(*volume->median_m, seen[seen.size() / 2 - 1]);
  EXPECT_LE(*volume->median_m, seen[seen.size() / 2 + 1]);
  EXPECT_GE(*volume->p90_m, seen[seen.size() * 9 / 10 - 1]);
  EXPECT_LE(*volume->p90_m, seen[seen.size() * 9 / 10 + 1]);
}

TEST(VolumeUncertainty, LeavesFarOutliersOutOfTheBox) {
  std::vector<Vector3d> points = points_in_a_box(2000);
  for (int i = 0; i < 5; ++i) points.emplace_back(50.0, -50.0, 50.0);

  const auto volume = volume_uncertainty(points, kRig, {}, 0.1);

  ASSERT_TRUE(volume);
  EXPECT_NEAR(volume->from_m.x(), 0.02, 0.02);  // the 1st percentile of 0 to 2 m
  EXPECT_NEAR(volume->to_m.x(), 1.98, 0.02);
  EXPECT_NEAR(volume->from_m.y(), 0.01, 0.02);
  EXPECT_NEAR(volume->to_m.z(), 1.49, 0.02);
}

TEST(VolumeUncertainty, HasSidesOfAtLeast20CentimetresForAFlatVolume) {
  std::vector<Vector3d> points = points_in_a_box(100);
  for (Vector3d& point : points) point.z() = 1.0;

  const auto volume = volume_uncertainty(points, kRig, {}, 0.1);

  ASSERT_TRUE(volume);
  EXPECT_NEAR(volume->from_m.z(), 0.9, 1e-12);
  EXPECT_NEAR(volume->to_m.z(), 1.1, 1e-12);
}

TEST(VolumeUncertainty, NeedsTenPoints) {
  EXPECT_FALSE(volume_uncertainty(points_in_a_box(9), kRig, {}, 0.1));
  EXPECT_TRUE(volume_uncertainty(points_in_a_box(10), kRig, {}, 0.1));
}

TEST(VolumeUncertainty, IsUnseenWithoutCameras) {
  const auto volume = volume_uncertainty(points_in_a_box(50), {}, {}, 0.1);

  ASSERT_TRUE(volume);
  EXPECT_EQ(volume->unseen_fraction, 1.0);
  EXPECT_FALSE(volume->median_m);
  EXPECT_FALSE(volume->p90_m);
}

}  // namespace volume_uncertainty_test
}  // namespace mocap::calibration
