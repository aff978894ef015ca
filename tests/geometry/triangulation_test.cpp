#include "geometry/triangulation.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

#include "geometry/lens.h"
#include "support/marker_world.h"

namespace mocap::geometry {
namespace triangulation_test {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::camera_at;
using test::look_at;
using test::ring;

Sighting sight(const CameraFromWorld& camera_from_world, const Vector3d& point) {
  const CameraPoint seen = camera_from_world * WorldPoint{point};
  Sighting sighting;
  sighting.camera_from_world = &camera_from_world;
  sighting.point = {seen.v.head<2>() / seen.v.z()};
  return sighting;
}

// The sighting of `point` by a camera with a lens; its pixel is displaced by `off_px`.
Sighting sight(const CameraModel& camera, const Vector3d& point, const Vector2d& off_px, double sigma_px) {
  const PixelPoint pixel{project(camera, {point})->v + off_px};
  Sighting sighting;
  sighting.camera_from_world = &camera.camera_from_world;
  sighting.point = *undistort(camera.lens, pixel);
  for (const int axis : {0, 1}) {
    const Vector2d beside = sighting.point.v + 1e-4 * Vector2d::Unit(axis);
    sighting.px_from_ray.col(axis) = (distort(camera.lens, {beside}).v - pixel.v) / 1e-4;
  }
  sighting.sigma_px = sigma_px;
  return sighting;
}

std::vector<Sighting> sight_all(const Rig& rig, const Vector3d& point, double sigma_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, sigma_px);
  std::vector<Sighting> sightings;
  for (const CameraModel& camera : rig) {
    sightings.push_back(sight(camera, point, {noise(random), noise(random)}, sigma_px));
    sightings.back().source = static_cast<std::uint32_t>(sightings.size() - 1);
  }
  return sightings;
}

TEST(Triangulate, FindsThePointOfPerfectSightings) {
  const Vector3d point(0.3, -0.2, 1.1);
  const Rig rig = ring(5);
  std::vector<Sighting> sightings;
  for (const CameraModel& camera : rig) sightings.push_back(sight(camera.camera_from_world, point));

  const auto found = triangulate(sightings);

  ASSERT_TRUE(found);
  EXPECT_LT((found->v - point).norm(), 1e-12);  // m; rounding
}

TEST(Triangulate, AgreesWithOpenCv) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 1e-4);  // a tenth of a pixel
  const Rig rig{camera_at({4.0, 0.0, 2.5}), camera_at({1.0, 3.8, 2.5})};
  for (const Vector3d& point : test::cloud(100, random)) {
    std::vector<Sighting> pair;
    cv::Mat projection[2];
    cv::Mat seen[2];
    for (int c = 0; c < 2; ++c) {
      const CameraFromWorld& from_world = rig[static_cast<std::size_t>(c)].camera_from_world;
      pair.push_back(sight(from_world, point));
      pair.back().point.v += Vector2d(noise(random), noise(random));
      projection[c] = cv::Mat(3, 4, CV_64F);
      for (int row = 0; row < 3; ++row) {
        for (int col = 0; col < 3; ++col) projection[c].at<double>(row, col) = from_world.rotation(row, col);
        projection[c].at<double>(row, 3) = from_world.translation[row];
      }
      seen[c] = (cv::Mat_<double>(2, 1) << pair.back().point.v.x(), pair.back().point.v.y());
    }
    cv::Mat reference;
    cv::triangulatePoints(projection[0], projection[1], seen[0], seen[1], reference);
    const cv::Mat1d h = reference;

    const auto found = triangulate(pair);

    ASSERT_TRUE(found);
    // Both methods are linear with different weights: the results differ in second order of the noise.
    EXPECT_LT((found->v - Vector3d(h(0), h(1), h(2)) / h(3)).norm(), 2e-4) << point.transpose();
  }
}

TEST(Triangulate, RefusesOneSighting) {
  const auto camera = look_at({0.0, -4.0, 1.0}, {0.0, 0.0, 1.0});
  const std::vector<Sighting> one{sight(camera, {0.1, 0.0, 1.0})};

  EXPECT_EQ(triangulate(one).error(), TriangulationFailure::TooFewSightings);
  EXPECT_EQ(refine(one, {}).error(), TriangulationFailure::TooFewSightings);
}

TEST(Triangulate, RefusesRaysThatAreNearlyParallel) {
  const auto left = look_at({-0.001, -4.0, 1.0}, {-0.001, 0.0, 1.0});
  const auto right = look_at({0.001, -4.0, 1.0}, {0.001, 0.0, 1.0});
  const Vector3d point(0.1, 0.0, 1.2);

  EXPECT_EQ(triangulate(std::vector<Sighting>{sight(left, point), sight(right, point)}).error(),
            TriangulationFailure::RaysNearlyParallel);
}

TEST(Triangulate, RefusesAPointOnTheLineBetweenTwoCamerasThatFaceEachOther) {
  const auto near = look_at({0.0, -4.0, 1.0}, {0.0, 0.0, 1.0});
  const auto far = look_at({0.0, 4.0, 1.0}, {0.0, 0.0, 1.0});
  const Vector3d point(0.0, 0.7, 1.0);

  EXPECT_EQ(triangulate(std::vector<Sighting>{sight(near, point), sight(far, point)}).error(),
            TriangulationFailure::RaysNearlyParallel);
}

TEST(Triangulate, RefusesAPointBehindACamera) {
  const auto left = look_at({-0.5, 0.0, 1.0}, {0.0, 5.0, 1.0});  // both cameras look along +y from y = 0
  const auto right = look_at({+0.5, 0.0, 1.0}, {0.0, 5.0, 1.0});
  const Vector3d behind(0.0, -2.0, 1.0);

  EXPECT_EQ(triangulate(std::vector<Sighting>{sight(left, behind), sight(right, behind)}).error(),
            TriangulationFailure::BehindACamera);
}

TEST(Refine, MinimisesTheReprojectionError) {
  std::mt19937 random(2);
  const Rig rig = ring(4);
  const auto sightings = sight_all(rig, {0.4, -0.3, 1.5}, 0.5, random);
  const auto cost = [&](const Vector3d& at) {
    double sum = 0.0;
    for (const Sighting& s : sightings) sum += std::pow(reprojection_error_px(s, {at}) / s.sigma_px, 2);
    return sum;
  };

  const auto refined = refine(sightings, *triangulate(sightings));

  ASSERT_TRUE(refined);
  // No step along any axis decreases the error. The test detects a thousandth of the standard deviation.
  const double least = cost(refined->point.v);
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma = std::sqrt(refined->covariance_m2(axis, axis));
    const double slope = (cost(refined->point.v + 0.01 * sigma * Vector3d::Unit(axis)) -
                          cost(refined->point.v - 0.01 * sigma * Vector3d::Unit(axis))) /
                         0.02;
    EXPECT_LT(std::abs(slope), 2e-3) << axis;
  }
  EXPECT_NEAR(refined->rms_px, std::sqrt(least * 0.25 / 4.0), 1e-9);
}

TEST(Refine, HasErrorsThatAgreeWithItsCovariance) {
  std::mt19937 random(3);
  const Rig rig = ring(4);
  double nees = 0.0;
  int count = 0;
  for (const Vector3d& point : test::cloud(4000, random)) {
    const auto sightings = sight_all(rig, point, 0.2, random);
    const auto refined = refine(sightings, *triangulate(sightings));
    ASSERT_TRUE(refined);
    const Vector3d error = refined->point.v - point;
    nees += error.dot(refined->covariance_m2.inverse() * error);
    ++count;
  }

  // The mean of 4000 chi-squares of 3 degrees of freedom: 3 with standard deviation sqrt(6 / 4000) = 0.04.
  EXPECT_NEAR(nees / count, 3.0, 0.12);
}

TEST(Refine, WeighsEachSightingByItsOwnSigma) {
  const Rig rig = ring(3);
  const Vector3d point(0.0, 0.1, 1.0);
  std::vector<Sighting> sightings{sight(rig[0], point, {0.0, 0.0}, 0.05), sight(rig[1], point, {0.0, 0.0}, 0.05),
                                  sight(rig[2], point, {3.0, -3.0}, 50.0)};

  const auto refined = refine(sightings, *triangulate(sightings));

  ASSERT_TRUE(refined);
  EXPECT_LT((refined->point.v - point).norm(), 1e-5);  // m; 3 px of equal weight would move it by 4 mm
}

TEST(Agree, KeepsAllSightingsIfAllAgree) {
  std::mt19937 random(4);
  const Rig rig = ring(6);
  auto sightings = sight_all(rig, {0.0, 0.5, 1.0}, 0.1, random);

  const auto agreed = agree(sightings, {});

  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->kept, 6u);
}

TEST(Agree, RemovesOneOrTwoOutliers) {
  std::mt19937 random(5);
  for (const std::size_t cameras : {4u, 5u, 8u, 12u}) {
    const Rig rig = ring(cameras);
    const Vector3d point(0.2, 0.1, 1.2);
    auto sightings = sight_all(rig, point, 0.1, random);
    sightings[1] = sight(rig[1], point, {12.0, 9.0}, 0.1);
    sightings[1].source = 1;
    const std::size_t wrong = cameras >= 8 ? 2 : 1;
    if (wrong == 2) {
      sightings[3] = sight(rig[3], point, {-7.0, 15.0}, 0.1);
      sightings[3].source = 3;
    }

    const auto agreed = agree(sightings, {});

    ASSERT_TRUE(agreed) << cameras;
    EXPECT_EQ(agreed->kept, cameras - wrong) << cameras;
    for (std::size_t i = 0; i < agreed->kept; ++i) EXPECT_NE(sightings[i].source, 1u) << cameras;
    EXPECT_LT((agreed->refined.point.v - point).norm(), 2e-3) << cameras;
  }
}

TEST(Agree, FindsTheOutlierAmongFourThatMovesThePoint) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> angle(0.0, 6.28);
  const Rig rig = ring(4);
  int right = 0;
  for (int k = 0; k < 200; ++k) {
    auto sightings = sight_all(rig, {0.3, 0.1, 1.2}, 0.1, random);
    const double turn = angle(random);
    const auto wrong = static_cast<std::size_t>(k % 4);
    sightings[wrong] = sight(rig[wrong], {0.3, 0.1, 1.2}, {15.0 * std::cos(turn), 15.0 * std::sin(turn)}, 0.1);
    sightings[wrong].source = static_cast<std::uint32_t>(wrong);

    const auto agreed = agree(sightings, {});

    right += agreed && agreed->kept == 3 && sightings[3].source == wrong ? 1 : 0;
  }

  EXPECT_GE(right, 190);  // in a few directions another subset agrees as well
}

TEST(Agree, FailsIfTwoRaysMissEachOther) {
  const Rig rig{camera_at({4.0, 0.0, 2.5}), camera_at({0.0, 4.0, 2.5})};
  std::vector<Sighting> pair{sight(rig[0], {0.0, 0.0, 1.0}, {0.0, 0.0}, 0.1),
                             sight(rig[1], {0.0, 0.0, 1.1}, {0.0, 0.0}, 0.1)};

  EXPECT_EQ(agree(pair, {}).error(), TriangulationFailure::Disagreement);
}

}  // namespace triangulation_test
}  // namespace mocap::geometry
