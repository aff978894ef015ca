#include "associate/predicted/batch_triangulator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "geometry/ray_quadric.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace batch_triangulator_test {

using namespace mocap::test;
using Eigen::Vector3d;

constexpr geometry::Agreement kAgreement{.floor_px = 1.0, .sigmas = 4.0};

/// Markers in the views of several cameras, with the true assignment of rays to markers.
struct MarkerScene {
  explicit MarkerScene(std::size_t cameras, double sigma_px = 0.1, double missed = 0.2)
      : rig(ring(cameras)), rays(std::make_unique<RayTable>(rig)) {
    world = see(rig, markers, {.sigma_px = sigma_px, .missed = missed}, random);
    predicted = expect(markers, 0.005, random);
    rays->begin(world.set);
    for (std::size_t view = 0; view < cameras; ++view) {
      rays->cast(view);
      assigned.emplace_back(markers.size()).begin(markers.size(), (*rays)[view].size());
      for (std::size_t ray = 0; ray < (*rays)[view].size(); ++ray) {
        const int marker = world.marker_of[view][(*rays)[view].blob[ray]];
        assigned[view].assign(static_cast<std::uint32_t>(marker), static_cast<std::uint32_t>(ray));
      }
    }
  }

  void triangulate() {
    triangulator.begin(predicted);
    for (std::size_t view = 0; view < assigned.size(); ++view) triangulator.add((*rays)[view], assigned[view]);
    triangulator.solve();
    triangulator.classify_outliers(kAgreement);
  }

  std::uint32_t ray_of(std::size_t view, std::uint32_t marker) const { return assigned[view].rays()[marker]; }
  /// Assigns the ray of a marker as shared and returns its position, which a test may displace.
  AssignedRay& share(std::size_t view, std::uint32_t marker) {
    return assigned[view].assign_shared(marker, ray_of(view, marker));
  }

  /// Triangulates one marker alone with geometry::agree, as the oracle.
  Result<geometry::Agreed, geometry::TriangulationFailure> alone(std::size_t marker) {
    BoundedVector<geometry::QuadricSighting, kMaxCameras> sightings;
    for (std::size_t view = 0; view < assigned.size(); ++view) {
      const std::uint32_t ray = assigned[view].rays()[marker];
      if (ray == AssignedRay::kNone) continue;
      (*rays)[view].make_quadric(ray);
      sightings.push_back((*rays)[view].sighting(ray, static_cast<std::uint32_t>(view)));
    }
    return geometry::agree(sightings, predicted.markers[marker].position, kAgreement);
  }

  std::mt19937 random{11};
  std::vector<Vector3d> markers = cloud(37, random);  // not a multiple of the SIMD width
  Rig rig;
  SeenWorld world;
  std::unique_ptr<RayTable> rays;
  Predictions predicted;
  std::vector<RayAssignments> assigned;  // by view
  BatchTriangulator triangulator{kMaxMarkers, kMaxCameras};
};

TEST(BatchTriangulator, AgreesWithATriangulationOfEachMarkerAlone) {
  MarkerScene given(6);

  given.triangulate();

  for (std::size_t m = 0; m < given.markers.size(); ++m) {
    const auto alone = given.alone(m);
    if (!alone || given.triangulator.ray_count(m) < 2) continue;
    ASSERT_TRUE(given.triangulator.rays_agree(m)) << m;
    EXPECT_EQ(given.triangulator.ray_count(m), alone->kept);
    const geometry::Refined batch = given.triangulator.triangulation(m);
    // Both solve the same equations. The results differ by rounding, at most 1 um.
    EXPECT_LT((batch.point.v - alone->refined.point.v).norm(), 1e-6);
    EXPECT_LT((batch.covariance_m2 - alone->refined.covariance_m2).norm(), 1e-6 * alone->refined.covariance_m2.norm());
    EXPECT_NEAR(batch.rms_px, alone->refined.rms_px, 0.01 * alone->refined.rms_px);  // single precision
  }
}

TEST(BatchTriangulator, HasErrorsThatAgreeWithItsCovariance) {
  MarkerScene given(8, 0.1, 0.0);

  given.triangulate();

  double sum = 0.0;
  for (std::size_t m = 0; m < given.markers.size(); ++m) {
    ASSERT_TRUE(given.triangulator.rays_agree(m));
    const geometry::Refined batch = given.triangulator.triangulation(m);
    const Vector3d offset = batch.point.v - given.markers[m];
    sum += offset.dot(batch.covariance_m2.inverse() * offset);
  }
  // 37 chi-squares with 3 degrees of freedom: mean 3, standard deviation of the mean 0.40. The tolerance is four of
  // these.
  EXPECT_NEAR(sum / static_cast<double>(given.markers.size()), 3.0, 1.6);
}

TEST(BatchTriangulator, ReportsDisagreementIfOneRayBelongsToAnotherMarker) {
  MarkerScene given(6, 0.05, 0.0);
  const std::uint32_t fourth = given.ray_of(2, 4), ninth = given.ray_of(2, 9);
  given.assigned[2].assign(4, ninth);
  given.assigned[2].assign(9, fourth);

  given.triangulate();

  for (std::size_t m = 0; m < given.markers.size(); ++m)
    EXPECT_EQ(given.triangulator.rays_agree(m), m != 4 && m != 9) << m;
}

TEST(BatchTriangulator, RefusesAMarkerWithFewerThanTwoRays) {
  MarkerScene given(6, 0.05, 0.0);
  for (std::size_t view = 1; view < given.assigned.size(); ++view) given.assigned[view].release(3);
  for (RayAssignments& view : given.assigned) view.release(5);

  given.triangulate();

  EXPECT_EQ(given.triangulator.ray_count(3), 1U);
  EXPECT_FALSE(given.triangulator.rays_agree(3));
  EXPECT_EQ(given.triangulator.ray_count(5), 0U);
  EXPECT_FALSE(given.triangulator.rays_agree(5));
  EXPECT_TRUE(given.triangulator.rays_agree(4));
}

TEST(BatchTriangulator, RefusesAPointFarFromItsPrediction) {
  MarkerScene given(6, 0.05, 0.0);
  given.predicted.markers[7].position.v.x() += 0.2;  // the depths are 2 to 6 m

  given.triangulate();

  EXPECT_FALSE(given.triangulator.rays_agree(7));
  EXPECT_TRUE(given.triangulator.rays_agree(8));
}

TEST(BatchTriangulator, RemovesOutlierRaysIfManyRaysAgree) {
  MarkerScene given(12, 0.05, 0.0);
  for (const std::size_t view : {2, 7}) given.share(view, 4).offset.x() = 0.02F;  // about 20 px
  given.triangulate();
  const bool agreed_at_once = given.triangulator.rays_agree(4);

  const auto removed = given.triangulator.reject_outliers(4, kAgreement);

  ASSERT_TRUE(removed);
  EXPECT_FALSE(agreed_at_once);
  EXPECT_EQ(*removed, std::uint64_t{1} << 2 | std::uint64_t{1} << 7);
  EXPECT_TRUE(given.triangulator.rays_agree(4));
  given.assigned[2].release(4);
  given.assigned[7].release(4);
  const auto alone = given.alone(4);
  ASSERT_TRUE(alone);
  EXPECT_EQ(given.triangulator.ray_count(4), alone->kept);
  const geometry::Refined batch = given.triangulator.triangulation(4);
  // Downdating leaves the rounding of single precision in the sums.
  EXPECT_LT((batch.point.v - alone->refined.point.v).norm(), 5e-6);
  EXPECT_LT((batch.covariance_m2 - alone->refined.covariance_m2).norm(), 1e-5 * alone->refined.covariance_m2.norm());
  EXPECT_NEAR(batch.rms_px, alone->refined.rms_px, 0.01 * alone->refined.rms_px);
}

TEST(BatchTriangulator, AddsARayThatWasFoundLater) {
  MarkerScene given(12, 0.05, 0.0);
  const auto whole = given.alone(6);
  const std::size_t later = given.ray_of(5, 6);
  const std::size_t wrong = given.ray_of(5, 8);
  given.assigned[5].release(6);
  given.assigned[5].release(8);
  given.triangulate();

  given.triangulator.add_ray(6, 5, (*given.rays)[5], later);
  given.triangulator.add_ray(8, 5, (*given.rays)[5], later);
  const auto true_ray_removed = given.triangulator.reject_outliers(6, kAgreement);
  const auto false_ray_removed = given.triangulator.reject_outliers(8, kAgreement);

  ASSERT_TRUE(whole && true_ray_removed && false_ray_removed);
  ASSERT_NE(later, wrong);
  EXPECT_EQ(*true_ray_removed, 0U);
  EXPECT_EQ(given.triangulator.ray_count(6), 12U);
  EXPECT_LT((given.triangulator.triangulation(6).point.v - whole->refined.point.v).norm(), 1e-6);
  EXPECT_EQ(*false_ray_removed, std::uint64_t{1} << 5);
  EXPECT_EQ(given.triangulator.ray_count(8), 11U);
}

TEST(BatchTriangulator, RemovesNoOutlierAmongFewRays) {
  MarkerScene given(8, 0.05, 0.0);
  given.share(2, 4).offset.x() = 0.02F;  // about 20 px
  given.triangulate();

  EXPECT_FALSE(given.triangulator.reject_outliers(4, kAgreement));
  EXPECT_FALSE(given.triangulator.rays_agree(4));
}

TEST(BatchTriangulator, KeepsTheOrderOfTheViewsIfOneIsEmpty) {
  MarkerScene given(12, 0.05, 0.0);
  given.world.frames[3]->blobs.clear();
  given.rays->cast(3);
  given.assigned[3].begin(given.markers.size(), 0);
  given.share(7, 4).offset.y() = 0.02F;  // about 20 px
  given.triangulate();

  const auto removed = given.triangulator.reject_outliers(4, kAgreement);

  ASSERT_TRUE(removed);
  EXPECT_EQ(*removed, std::uint64_t{1} << 7);
}

TEST(BatchProjector, FindsTheNearestUnassignedRayOfEachView) {
  MarkerScene given(6, 0.05, 0.1);
  const Eigen::Matrix3d covariance_m2 = 0.002 * 0.002 * Eigen::Matrix3d::Identity();
  constexpr double kSigmas = 3.5, kFloor_px = 0.5;
  for (std::size_t view = 0; view < given.assigned.size(); ++view) (*given.rays)[view].increment_use(0);
  given.rays->list_unassigned(kSigmas);

  std::size_t found = 0;
  for (const PredictedMarker& marker : given.predicted.markers) {
    given.rays->project_gaussian(marker.position.v, covariance_m2, kSigmas, kFloor_px);
    for (std::size_t view = 0; view < given.assigned.size(); ++view) {
      // Oracle: all rays one by one, in double precision.
      const ViewRays& rays = (*given.rays)[view];
      const auto projection = rays.projection(marker.position.v, covariance_m2);
      std::optional<std::size_t> nearest;
      double least = kSigmas * kSigmas;
      for (std::size_t ray = 1; projection && ray < rays.size(); ++ray) {
        const double ray_px2 = rays.sigma_px[ray] * rays.sigma_px[ray] + kFloor_px * kFloor_px;
        const Eigen::Matrix2d covariance =
            projection->covariance + Eigen::Matrix2d::Identity() * ray_px2 / (rays.focal_px * rays.focal_px);
        const Eigen::Vector2d offset = Eigen::Vector2d(rays.x(ray), rays.y(ray)) - projection->centre;
        const double distance2 = offset.dot(covariance.inverse() * offset);
        if (distance2 >= least) continue;
        least = distance2;
        nearest = ray;
      }
      EXPECT_EQ(given.rays->nearest_unassigned(view), nearest);
      found += nearest ? 1 : 0;
    }
  }

  EXPECT_GT(found, 100U);
}

TEST(ViewRays, CountsTheUnassignedRays) {
  MarkerScene given(2, 0.05, 0.0);
  ViewRays& rays = (*given.rays)[0];
  const std::size_t all = rays.size();

  rays.increment_use(3);
  rays.increment_use(3);
  rays.increment_use(5);
  rays.decrement_use(3);
  rays.decrement_use(5);

  EXPECT_EQ(rays.unassigned_count(), all - 1);
  std::vector<std::size_t> unassigned;
  rays.for_each_unassigned([&](std::size_t ray) { unassigned.push_back(ray); });
  EXPECT_EQ(unassigned.size(), all - 1);
  EXPECT_EQ(std::ranges::count(unassigned, 3U), 0);
}

}  // namespace batch_triangulator_test
}  // namespace mocap::associate
