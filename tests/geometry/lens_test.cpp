#include "geometry/lens.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <vector>

namespace mocap::geometry {
namespace lens_test {

Lens distorted_lens(LensKind kind) {
  Lens lens{kind, 900.0, 910.0, 652.0, 500.0, {}};
  if (kind == LensKind::Fisheye) {
    lens.distortion << 0.05, -0.01, 0.004, -0.001, 0.0;
  } else {
    lens.distortion << -0.21, 0.09, 0.001, -0.0007, -0.012;
  }
  return lens;
}

cv::Matx33d matrix(const Lens& lens) { return {lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1}; }

class BothLenses : public testing::TestWithParam<LensKind> {};

TEST_P(BothLenses, DistortLikeOpenCv) {
  const Lens lens = distorted_lens(GetParam());
  for (double x = -0.6; x <= 0.6; x += 0.2) {
    for (double y = -0.5; y <= 0.5; y += 0.25) {
      std::vector<cv::Point2d> reference;
      const std::vector<cv::Point3d> point{{x, y, 1.0}};
      const cv::Vec3d zero(0, 0, 0);
      if (GetParam() == LensKind::Fisheye) {
        const cv::Vec4d k(lens.distortion[0], lens.distortion[1], lens.distortion[2], lens.distortion[3]);
        cv::fisheye::projectPoints(point, reference, zero, zero, matrix(lens), k);
      } else {
        const cv::Vec<double, 5> k(lens.distortion.data());
        cv::projectPoints(point, zero, zero, matrix(lens), k, reference);
      }

      const PixelPoint ours = distort(lens, {{x, y}});

      EXPECT_NEAR(ours.v.x(), reference[0].x, 1e-9) << x << " " << y;
      EXPECT_NEAR(ours.v.y(), reference[0].y, 1e-9) << x << " " << y;
    }
  }
}

TEST_P(BothLenses, UndistortFindsTheRayOfEveryPixelOfTheImage) {
  const Lens lens = distorted_lens(GetParam());
  for (int x = 0; x <= 1280; x += 128) {
    for (int y = 0; y <= 1024; y += 128) {
      const PixelPoint pixel{{x, y}};
      const auto ray = undistort(lens, pixel);
      ASSERT_TRUE(ray) << x << " " << y;
      EXPECT_LT((distort(lens, *ray).v - pixel.v).norm(), 1e-6) << x << " " << y;
    }
  }
}

TEST_P(BothLenses, HaveTheDerivativeOfFiniteDifferences) {
  const Lens lens = distorted_lens(GetParam());
  constexpr double kStep = 1e-5;
  for (double x = -0.6; x <= 0.61; x += 0.2) {
    for (double y = -0.5; y <= 0.51; y += 0.25) {
      const DistortedRay at = distort_with_slope(lens, {{x, y}});

      EXPECT_LT((at.pixel.v - distort(lens, {{x, y}}).v).norm(), 1e-12);
      Eigen::Matrix2d by_differences;
      by_differences << (distort(lens, {{x + kStep, y}}).v - distort(lens, {{x - kStep, y}}).v) / (2.0 * kStep),
          (distort(lens, {{x, y + kStep}}).v - distort(lens, {{x, y - kStep}}).v) / (2.0 * kStep);
      EXPECT_LT((at.px_from_ray - by_differences).norm(), 1e-5)
          << x << " " << y;  // px; focal length 900 px, error quadratic in the step
    }
  }
}

TEST_P(BothLenses, UndistortToAMillionthOfAPixelAtTheBorder) {
  const Lens lens = distorted_lens(GetParam());
  for (double along = 0.0; along <= 1.0; along += 0.05) {
    const Eigen::Vector2d corner(1279.5, 1023.5);
    for (const Eigen::Vector2d& at :
         {Eigen::Vector2d(along * corner.x(), -0.5), Eigen::Vector2d(-0.5, along * corner.y()),
          Eigen::Vector2d(along * corner.x(), corner.y()), Eigen::Vector2d(corner.x(), along * corner.y())}) {
      const auto ray = undistort(lens, {at});
      ASSERT_TRUE(ray) << at.transpose();
      EXPECT_LT((distort(lens, *ray).v - at).norm(), 1e-6) << at.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lens, BothLenses, testing::Values(LensKind::Pinhole, LensKind::Fisheye));

TEST(Undistort, GivesNoRayWhereTheDistortionFoldsTheImage) {
  Lens lens{LensKind::Pinhole, 500.0, 500.0, 320.0, 240.0, {}};
  lens.distortion << -0.5, 0.0, 0.0, 0.0, 0.0;  // r (1 - r^2 / 2) never exceeds 0.544

  EXPECT_FALSE(undistort(lens, {{320.0 + 500.0 * 0.6, 240.0}}));
}

TEST(Project, SeesNothingBehindTheCamera) {
  CameraModel camera;
  camera.lens = distorted_lens(LensKind::Pinhole);

  EXPECT_FALSE(project(camera, {{0.0, 0.0, -2.0}}));
  EXPECT_TRUE(project(camera, {{0.0, 0.0, 2.0}}));
}

}  // namespace lens_test
}  // namespace mocap::geometry
