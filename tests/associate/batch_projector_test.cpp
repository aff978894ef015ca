#include "associate/rays/batch_projector.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "associate/rays/view_rays.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace batch_projector_test {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace mocap::test;

constexpr double kSigmas = 4.0;
constexpr double kFloor_px = 0.5;

// Seven cameras that see 120 markers; every third ray belongs to a match.
struct Views {
  Views() : markers(cloud(120, random)), world(see(rig, markers, {.sigma_px = 0.3}, random)) {
    rays->begin(world.set);
    for (std::size_t view = 0; view < rig.size(); ++view) {
      rays->cast(view);
      for (std::size_t ray = 0; ray < (*rays)[view].size(); ray += 3) (*rays)[view].increment_use(ray);
      (*rays)[view].list_unassigned(static_cast<float>(kSigmas));
      projector->place(view, (*rays)[view]);
    }
  }
  // The squared Mahalanobis distance of a ray, in double precision.
  double distance2(const ViewRays& view, std::size_t ray, const Vector3d& at, const Matrix3d& covariance_m2) const {
    const auto projection = view.projection(at, covariance_m2);
    if (!projection) return std::numeric_limits<double>::infinity();
    const double added_px2 = kFloor_px * kFloor_px + view.sigma_px[ray] * view.sigma_px[ray];
    const Eigen::Matrix2d covariance =
        projection->covariance + added_px2 / (view.focal_px * view.focal_px) * Eigen::Matrix2d::Identity();
    const Vector2d off = Vector2d(view.x(ray), view.y(ray)) - projection->centre;
    return off.dot(covariance.inverse() * off);
  }

  std::mt19937 random{31};
  Rig rig = ring(7);
  std::vector<Vector3d> markers;
  SeenWorld world;
  std::unique_ptr<RayTable> rays = std::make_unique<RayTable>(rig);
  std::unique_ptr<BatchProjector> projector = std::make_unique<BatchProjector>();
};

TEST(BatchProjector, FindsTheRayThatASearchOfAllRaysInDoublePrecisionFinds) {
  Views views;
  std::uniform_real_distribution<double> near(-0.03, 0.03);
  Matrix3d covariance;
  covariance << 9.0, 2.0, -1.0, 2.0, 4.0, 1.0, -1.0, 1.0, 6.0;
  covariance *= 1e-5;  // standard deviations of 6 to 10 mm
  int found_rays = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    const Vector3d at =
        views.markers[i % views.markers.size()] + Vector3d(near(views.random), near(views.random), near(views.random));
    views.projector->cast({at, covariance, kSigmas, kFloor_px}, views.rig.size());
    for (std::size_t v = 0; v < views.rig.size(); ++v) {
      const ViewRays& view = (*views.rays)[v];

      const auto found = views.projector->nearest_unassigned(v, view);

      double least = kSigmas * kSigmas;
      view.for_each_unassigned(
          [&](std::size_t ray) { least = std::min(least, views.distance2(view, ray, at, covariance)); });
      // Single precision: a thousandth of a pixel at a standard deviation of half a pixel and more.
      constexpr double kRounding = 0.05;
      if (found) {
        EXPECT_EQ(view.use_count[*found], 0);
        EXPECT_LT(views.distance2(view, *found, at, covariance), least + kRounding);
      } else {
        EXPECT_GT(least, kSigmas * kSigmas - kRounding);
      }
      found_rays += found ? 1 : 0;
    }
  }
  EXPECT_GT(found_rays, 200);
}

TEST(BatchProjector, FindsNoRayThatWasAssignedAfterwards) {
  Views views;
  ViewRays& view = (*views.rays)[0];
  const Matrix3d covariance = 1e-6 * Matrix3d::Identity();
  const std::size_t ray = 1;  // unassigned
  const Vector3d at = views.markers[static_cast<std::size_t>(views.world.marker_of[0][ray])];
  views.projector->cast({at, covariance, kSigmas, kFloor_px}, views.rig.size());
  ASSERT_EQ(views.projector->nearest_unassigned(0, view), ray);

  view.increment_use(ray);
  EXPECT_NE(views.projector->nearest_unassigned(0, view), ray);
  view.decrement_use(ray);

  EXPECT_EQ(views.projector->nearest_unassigned(0, view), ray);
}

TEST(BatchProjector, FindsNothingForAPointBehindTheCamera) {
  Views views;
  const Vector3d eye = views.rig[0].centre().v;
  const ViewRays& view = (*views.rays)[0];
  const Vector3d ahead = eye + view.direction(1);  // on an unassigned ray
  const Vector3d behind = eye - view.direction(1);
  const Matrix3d covariance = 1e-6 * Matrix3d::Identity();

  views.projector->cast({ahead, covariance, kSigmas, kFloor_px}, views.rig.size());
  EXPECT_EQ(views.projector->nearest_unassigned(0, view), 1U);
  views.projector->cast({behind, covariance, kSigmas, kFloor_px}, views.rig.size());
  EXPECT_FALSE(views.projector->nearest_unassigned(0, view));
}

}  // namespace batch_projector_test
}  // namespace mocap::associate
