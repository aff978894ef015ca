#include "geometry/ray_quadric.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "geometry/lens.h"
#include "support/marker_world.h"

namespace mocap::geometry {
namespace ray_quadric_test {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::camera_at;
using test::ring;

// Several cameras and the noisy view of one point in each.
struct Seen {
  Rig rig;
  std::vector<CameraRows> rows;
  std::vector<PixelPoint> pixels;
  std::vector<double> sigma_px;
  std::vector<Ray> rays;
  std::vector<RayQuadric> quadrics;

  Seen(const Rig& cameras, const Vector3d& point, std::span<const double> sigmas_px, std::mt19937& random)
      : rig(cameras) {
    std::normal_distribution<double> noise;
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const double sigma = sigmas_px[c % sigmas_px.size()];
      pixels.push_back({project(rig[c], {point})->v + sigma * Vector2d(noise(random), noise(random))});
      sigma_px.push_back(sigma);
      rows.emplace_back(rig[c].camera_from_world);
    }
    cast();
  }

  void cast() {
    rays.clear();
    quadrics.clear();
    for (std::size_t c = 0; c < rig.size(); ++c) {
      rays.push_back(*ray_of(rig[c].lens, pixels[c]));
      quadrics.push_back(quadric_of(rows[c], rays[c], sigma_px[c]));
    }
  }

  std::vector<QuadricSighting> sightings() const {
    std::vector<QuadricSighting> all;
    for (std::uint32_t c = 0; c < rig.size(); ++c) {
      all.push_back({&quadrics[c], &rows[c].depth, sigma_px[c], c});
    }
    return all;
  }
};

constexpr std::array<double, 3> kSigmas_px{0.05, 0.2, 0.3};

// Residual for Ceres: the reprojection error in standard deviations, with the full lens model instead of its
// derivative.
struct Reprojection {
  const CameraModel* camera;
  PixelPoint pixel;
  double sigma_px;

  bool operator()(const double* point, double* error) const {
    const auto at = project(*camera, {Vector3d(point[0], point[1], point[2])});
    if (!at) return false;
    const Vector2d off = (at->v - pixel.v) / sigma_px;
    error[0] = off.x();
    error[1] = off.y();
    return true;
  }
};

Vector3d optimum(const Seen& seen, const Vector3d& start) {
  Vector3d point = start;
  ceres::Problem problem;
  for (std::size_t c = 0; c < seen.rig.size(); ++c) {
    problem.AddResidualBlock(new ceres::NumericDiffCostFunction<Reprojection, ceres::CENTRAL, 2, 3>(
                                 new Reprojection{&seen.rig[c], seen.pixels[c], seen.sigma_px[c]}),
                             nullptr, point.data());
  }
  ceres::Solver::Options options;
  options.function_tolerance = options.parameter_tolerance = options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return point;
}

TEST(RayQuadric, IsTheSquaredReprojectionErrorOfAnyPoint) {
  std::mt19937 random(1);
  const Vector3d point(0.3, -0.4, 1.2);
  const Seen seen(ring(5), point, kSigmas_px, random);
  for (std::size_t c = 0; c < 5; ++c) {
    const Vector3d near = point + Vector3d(0.001, -0.002, 0.0015);
    const Eigen::Vector4d h = near.homogeneous();
    const auto& q = seen.quadrics[c].q;
    const double form = q[0] * h[0] * h[0] + q[1] * h[1] * h[1] + q[2] * h[2] * h[2] + q[3] +
                        2.0 * (q[4] * h[0] * h[1] + q[5] * h[1] * h[2] + q[6] * h[2] * h[0]) +
                        2.0 * (q[8] * h[0] + q[9] * h[1] + q[10] * h[2]);
    const double depth = seen.rows[c].depth.dot(h);

    const double off_px = std::sqrt(form) / depth * seen.sigma_px[c];

    // The error is half a pixel, and the derivative of the lens changes by a thousandth over half a pixel.
    const double truth_px = (project(seen.rig[c], {near})->v - seen.pixels[c].v).norm();
    EXPECT_NEAR(off_px, truth_px, 2e-3 * truth_px) << c;
  }
}

TEST(RayQuadric, IsTheSameForManyRaysAsForEachAlone) {
  std::mt19937 random(2);
  const Seen seen(ring(1), {0.1, 0.2, 1.0}, kSigmas_px, random);
  RayColumns rays(3);
  rays.resize(3);
  for (std::size_t i = 0; i < 3; ++i) {
    rays.x[i] = seen.rays[0].point.v.x() + 0.01 * static_cast<double>(i);
    rays.y[i] = seen.rays[0].point.v.y();
    rays.ux[i] = seen.rays[0].px_from_ray(0, 0);
    rays.uy[i] = seen.rays[0].px_from_ray(0, 1);
    rays.vx[i] = seen.rays[0].px_from_ray(1, 0);
    rays.vy[i] = seen.rays[0].px_from_ray(1, 1);
  }
  std::vector<RayQuadric> many(3);

  quadrics_of(seen.rows[0], rays, kSigmas_px, many);

  for (std::size_t i = 0; i < 3; ++i) {
    const RayQuadric one = quadric_of(seen.rows[0], rays[i], kSigmas_px[i]);
    for (std::size_t k = 0; k < 12; ++k) EXPECT_DOUBLE_EQ(many[i].q[k], one.q[k]) << i << " " << k;
  }
}

TEST(AgreeOnQuadrics, FindsThePointThatCeresFinds) {
  std::mt19937 random(3);
  for (const std::size_t cameras : {2u, 3u, 8u, 16u}) {
    for (const Vector3d& point : test::cloud(25, random)) {
      const Seen seen(ring(cameras), point, kSigmas_px, random);
      auto sightings = seen.sightings();

      const auto agreed = agree(sightings, {point + Vector3d(0.02, -0.03, 0.02)}, {2.0, 4.0});
      const auto again = agree(sightings, agreed->refined.point, {2.0, 4.0});

      ASSERT_TRUE(agreed && again);
      ASSERT_EQ(agreed->kept, cameras);
      const Vector3d best = optimum(seen, point);
      const auto sigmas_off = [&](const Refined& found) {
        const Vector3d off = found.point.v - best;
        return std::sqrt(off.dot(found.covariance_m2.inverse() * off));
      };
      // In standard deviations. A start 4 cm off, which is 1 % of the depth, makes the weights wrong by 2 %. From a
      // near start the error is reprojection error over focal length, 3e-4.
      EXPECT_LT(sigmas_off(agreed->refined), 0.05) << cameras;
      EXPECT_LT(sigmas_off(again->refined), 0.005) << cameras;
    }
  }
}

TEST(AgreeOnQuadrics, HasErrorsThatAgreeWithItsCovariance) {
  std::mt19937 random(4);
  const Rig rig = ring(4);
  double nees = 0.0;
  for (const Vector3d& point : test::cloud(3000, random)) {
    const Seen seen(rig, point, kSigmas_px, random);
    auto sightings = seen.sightings();
    const auto agreed = agree(sightings, {point}, {2.0, 5.0});
    ASSERT_TRUE(agreed);
    const Vector3d error = agreed->refined.point.v - point;
    nees += error.dot(agreed->refined.covariance_m2.inverse() * error);
  }

  // The mean of 3000 chi-squares of 3 degrees of freedom: 3 with standard deviation sqrt(6 / 3000) = 0.045.
  EXPECT_NEAR(nees / 3000, 3.0, 0.14);
}

TEST(AgreeOnQuadrics, ConvergesFromAStartHalfAMetreOff) {
  std::mt19937 random(5);
  const Vector3d point(0.2, 0.3, 1.1);
  const Seen seen(ring(6), point, kSigmas_px, random);
  auto near = seen.sightings();
  auto far = seen.sightings();

  const auto from_near = agree(near, {point}, {2.0, 4.0});
  const auto from_far = agree(far, {point + Vector3d(0.3, -0.3, 0.25)}, {2.0, 4.0});

  ASSERT_TRUE(from_near && from_far);
  EXPECT_LT((from_near->refined.point.v - from_far->refined.point.v).norm(),
            2e-6);  // m; the standard deviation is 2e-4
}

// An outlier with a small sigma moves the point so far that another view may have the largest error. Only leaving out
// each view in direction identifies the outlier.
TEST(AgreeOnQuadrics, RemovesTheOutlierEvenIfAnotherViewHasALargerError) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> angle(0.0, 6.28);
  const Agreement agreement{0.2, 4.0};
  const Vector3d point(0.3, 0.1, 1.2);
  int misleading = 0;
  int right = 0;
  for (int k = 0; k < 200; ++k) {
    const auto wrong = static_cast<std::size_t>(k % 4);
    std::array<double, 4> sigmas{0.3, 0.3, 0.3, 0.3};
    sigmas[wrong] = 0.05;
    Seen seen(ring(4), point, sigmas, random);
    const double direction = angle(random);
    seen.pixels[wrong].v += 15.0 * Vector2d(std::cos(direction), std::sin(direction));
    seen.cast();
    // Cases in which another view has the largest ratio of error to limit at the optimum of all four views.
    const Vector3d of_all = optimum(seen, point);
    const auto excess = [&](std::size_t c) {
      return (project(seen.rig[c], {of_all})->v - seen.pixels[c].v).norm() / std::hypot(0.2, 4.0 * sigmas[c]);
    };
    std::size_t worst = 0;
    for (std::size_t c = 1; c < 4; ++c) worst = excess(c) > excess(worst) ? c : worst;
    if (worst == wrong) continue;
    ++misleading;
    auto sightings = seen.sightings();

    const auto agreed = agree(sightings, {point}, agreement);

    right += agreed && agreed->kept == 3 && sightings[3].source == wrong ? 1 : 0;
  }

  EXPECT_GE(misleading, 100);
  EXPECT_GE(right, misleading * 95 / 100);  // in a few directions another subset agrees as well
}

TEST(AgreeOnQuadrics, KeepsTheSubsetThatBruteForceOverAllSubsetsFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(0.0, 6.28);
  int same = 0;
  for (int k = 0; k < 100; ++k) {
    const Vector3d point(-0.2, 0.4, 0.9);
    const std::array<double, 1> sigma{0.1};
    Seen seen(ring(6), point, sigma, random);
    for (const std::size_t wrong : {static_cast<std::size_t>(k % 6), static_cast<std::size_t>((k + 2) % 6)}) {
      const double direction = angle(random);
      seen.pixels[wrong].v += 20.0 * Vector2d(std::cos(direction), std::sin(direction));
    }
    seen.cast();
    const Agreement agreement{1.0, 4.0};
    // The largest set of views that all agree on their own point.
    unsigned best = 0;
    for (unsigned subset = 1; subset < 64; ++subset) {
      if (std::popcount(subset) <= std::popcount(best) || std::popcount(subset) < 3) continue;
      std::vector<Sighting> some;
      for (std::uint32_t c = 0; c < 6; ++c) {
        if ((subset >> c & 1U) == 0) continue;
        some.push_back({&seen.rig[c].camera_from_world, seen.rays[c].point, seen.rays[c].px_from_ray, 0.1, c});
      }
      const auto found = agree(some, agreement);  // the implementation for Sighting
      if (found && found->kept == some.size()) best = subset;
    }
    auto sightings = seen.sightings();

    const auto agreed = agree(sightings, {point}, agreement);

    unsigned kept = 0;
    for (std::size_t i = 0; agreed && i < agreed->kept; ++i) kept |= 1U << sightings[i].source;
    same += kept == best ? 1 : 0;
  }

  EXPECT_GE(same, 97);  // removing one view at a time does not test all subsets
}

TEST(AgreeOnQuadrics, GivesNoPointBetweenTwoCamerasThatFaceEachOther) {
  std::mt19937 random(8);
  const std::array<double, 1> sigma{0.1};
  const Seen seen({camera_at({4.0, 0.0, 1.0}), camera_at({-4.0, 0.0, 1.0})}, {0.3, 0.0, 1.0}, sigma, random);
  auto sightings = seen.sightings();

  const auto agreed = agree(sightings, {{0.3, 0.0, 1.0}}, {2.0, 4.0});

  // No point, or a covariance of more than 10 cm along the depth.
  EXPECT_TRUE(!agreed || agreed->refined.covariance_m2(0, 0) > 0.01);
}

TEST(AgreeOnQuadrics, RemovesACameraThatHasThePointBehindIt) {
  std::mt19937 random(9);
  const std::array<double, 1> sigma{0.1};
  const Vector3d point(0.0, 0.1, 1.0);
  Seen seen(ring(4), point, sigma, random);
  seen.rig[2].camera_from_world = test::look_at({0.5, 0.1, 1.0}, {4.0, 0.3, 1.0});  // looks away from the point
  seen.rows[2] = CameraRows(seen.rig[2].camera_from_world);
  seen.cast();
  auto sightings = seen.sightings();

  const auto agreed = agree(sightings, {point}, {1.0, 4.0});

  ASSERT_TRUE(agreed);
  EXPECT_EQ(agreed->kept, 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NE(sightings[i].source, 2u);
}

TEST(AgreeOnQuadrics, FailsIfTwoRaysMissEachOther) {
  std::mt19937 random(10);
  const std::array<double, 1> sigma{0.1};
  Seen seen({camera_at({4.0, 0.0, 2.5}), camera_at({0.0, 4.0, 2.5})}, {0.0, 0.0, 1.0}, sigma, random);
  seen.pixels[1].v.y() += 20.0;
  seen.cast();
  auto sightings = seen.sightings();

  EXPECT_EQ(agree(sightings, {{0.0, 0.0, 1.0}}, {1.0, 4.0}).error(), TriangulationFailure::Disagreement);
}

}  // namespace ray_quadric_test
}  // namespace mocap::geometry
