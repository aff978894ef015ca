#include "associate/rays/view_rays.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "support/marker_world.h"

namespace mocap::associate {
namespace view_rays_test {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace mocap::test;

// Three cameras that see 43 markers without noise.
struct Table {
  Table() : markers(cloud(43, random)), world(see(rig, markers, {.sigma_px = 1e-12}, random)) {
    for (const auto& frame : world.frames) {
      for (Blob& blob : frame->blobs) blob.sigma_px = 0.2;
    }
  }
  void cast() {
    rays->begin(world.set);
    for (std::size_t view = 0; view < rays->view_count(); ++view) rays->cast(view);
  }

  std::mt19937 random{17};
  Rig rig = ring(3);
  std::vector<Vector3d> markers;
  SeenWorld world;
  std::unique_ptr<RayTable> rays = std::make_unique<RayTable>(rig);
};

std::vector<std::size_t> unassigned(const ViewRays& view) {
  std::vector<std::size_t> found;
  view.for_each_unassigned([&](std::size_t ray) { found.push_back(ray); });
  return found;
}

TEST(ViewRays, PointFromTheCameraToTheMarkerOfEachBlob) {
  Table table;

  table.cast();

  for (std::size_t v = 0; v < 3; ++v) {
    const ViewRays& view = (*table.rays)[v];
    ASSERT_EQ(view.size(), table.world.frames[v]->blobs.size());
    for (std::size_t ray = 0; ray < view.size(); ++ray) {
      const Vector3d& marker = table.markers[static_cast<std::size_t>(table.world.marker_of[v][ray])];
      const Vector3d truth = (marker - table.rig[v].centre().v).normalized();
      // rad and px: the lens correction is exact to 1e-6 px at a focal length of 900 px.
      EXPECT_LT((view.direction(ray) - truth).norm(), 1e-8);
      EXPECT_LT(view.off_px(ray, {marker}), 1e-5);
      // The same camera without distortion, with the focal length of the view.
      CameraModel pinhole = table.rig[v];
      pinhole.lens = {.fx_px = view.focal_px, .fy_px = view.focal_px};
      const WorldPoint beside{marker + Vector3d(0.02, -0.01, 0.03)};
      const Vector2d off_px = geometry::project(pinhole, beside)->v - geometry::project(pinhole, {marker})->v;
      EXPECT_NEAR(view.off_px(ray, beside), off_px.norm(), 1e-5);
    }
  }
}

TEST(ViewRays, LeaveOutBlobsWithoutAPositionAndKeepTheOrderOfTheOthers) {
  Table table;
  Blobs& blobs = table.world.frames[1]->blobs;
  const std::size_t count = blobs.size();
  blobs[3].centroid.v.x() = std::numeric_limits<double>::quiet_NaN();
  blobs[7].sigma_px = std::numeric_limits<double>::infinity();
  blobs[8].track = BlobTrackId{5};

  table.cast();

  const ViewRays& view = (*table.rays)[1];
  ASSERT_EQ(view.size(), count - 2);
  std::size_t ray = 0;
  for (std::size_t blob = 0; blob < count; ++blob) {
    if (blob == 3 || blob == 7) continue;
    EXPECT_EQ(view.blob[ray], blob);
    EXPECT_EQ(view.track[ray], blobs[blob].track);
    const auto marker = static_cast<std::size_t>(table.world.marker_of[1][blob]);
    EXPECT_LT(view.off_px(ray++, {table.markers[marker]}), 1e-5);
  }
  EXPECT_TRUE(view.any_track);
  EXPECT_FALSE((*table.rays)[0].any_track);
}

TEST(ViewRays, ListEachRayWithoutAMatchInOrder) {
  Table table;
  table.cast();
  ViewRays& view = (*table.rays)[0];
  std::bernoulli_distribution coin(0.5);
  std::vector<std::size_t> expected;
  for (std::size_t ray = 0; ray < view.size(); ++ray) {
    if (coin(table.random)) {
      view.increment_use(ray);
    } else {
      expected.push_back(ray);
    }
  }

  EXPECT_EQ(unassigned(view), expected);
  EXPECT_EQ(view.unassigned_count(), expected.size());
}

TEST(ViewRays, CountEachMatchOfARay) {
  Table table;
  table.cast();
  ViewRays& view = (*table.rays)[0];
  for (std::size_t ray = 1; ray < view.size(); ++ray) view.increment_use(ray);
  view.increment_use(2);
  table.rays->list_unassigned(4.0);

  view.decrement_use(1);
  view.decrement_use(2);

  EXPECT_EQ(unassigned(view), (std::vector<std::size_t>{0, 1}));
  // A released ray can be found again.
  EXPECT_TRUE(view.listed().has(1));
  EXPECT_FALSE(view.listed().has(2));
}

TEST(ViewRays, ProjectAGaussianAsItsSamples) {
  Table table;
  table.cast();
  const ViewRays& view = (*table.rays)[2];
  Matrix3d covariance;
  covariance << 4.0, 1.0, -0.5, 1.0, 2.0, 0.3, -0.5, 0.3, 1.0;
  covariance *= 1e-6;  // standard deviations of 1 to 2 mm
  const Matrix3d root = covariance.llt().matrixL();
  const Vector3d mean(0.9, 0.8, 1.7);  // far from the optical axis

  const auto projected = view.projection(mean, covariance);

  ASSERT_TRUE(projected);
  std::normal_distribution<double> normal;
  constexpr int kSamples = 100'000;
  Vector2d sum = Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Vector3d point = mean + root * Vector3d(normal(table.random), normal(table.random), normal(table.random));
    const Vector3d seen = (table.rig[2].camera_from_world * WorldPoint{point}).v;
    const Vector2d off = seen.head<2>() / seen.z() - projected->centre;
    sum += off;
    square += off * off.transpose();
  }
  const double sigma = std::sqrt(projected->covariance.trace());
  // The error of a mean of 100 000 samples is 0.3 % of the standard deviation, that of a variance 0.45 %.
  EXPECT_LT((sum / kSamples).norm(), 0.02 * sigma);
  EXPECT_LT((square / kSamples - projected->covariance).norm(), 0.03 * projected->covariance.norm());
}

TEST(ViewRays, ProjectNothingThatIsBehindTheCameraOrTooNear) {
  Table table;
  table.cast();
  const ViewRays& view = (*table.rays)[0];
  const Vector3d eye = table.rig[0].centre().v;
  const Vector3d forward = (Vector3d(0.0, 0.0, 1.0) - eye).normalized();

  EXPECT_FALSE(view.projection(eye - forward, Matrix3d::Identity()));
  EXPECT_FALSE(view.projection(eye + 0.9 * kMinDepth_m * forward, Matrix3d::Identity()));
  EXPECT_TRUE(view.projection(eye + 1.1 * kMinDepth_m * forward, Matrix3d::Identity()));
}

TEST(ViewRays, BoundAllRays) {
  Table table;
  table.world.frames[0]->blobs[5].sigma_px = 0.7;

  table.cast();

  const ViewRays& view = (*table.rays)[0];
  EXPECT_EQ(view.bounds().min_x, std::ranges::min(view.x_f));
  EXPECT_EQ(view.bounds().max_x, std::ranges::max(view.x_f));
  EXPECT_EQ(view.bounds().min_y, std::ranges::min(view.y_f));
  EXPECT_EQ(view.bounds().max_y, std::ranges::max(view.y_f));
  EXPECT_NEAR(std::sqrt(view.bounds().max_variance) * view.focal_px, 0.7, 1e-4);  // px: single precision
}

TEST(RayTable, KnowsTheViewOfEachCameraOfTheSet) {
  Table table;
  table.world.set.views.clear();
  table.world.set.views.push_back(table.world.frames[2].get());
  table.world.set.views.push_back(table.world.frames[0].get());

  table.cast();

  EXPECT_EQ(table.rays->view_count(), 2U);
  EXPECT_EQ(table.rays->view_of(2), 0U);
  EXPECT_EQ(table.rays->view_of(0), 1U);
  EXPECT_FALSE(table.rays->view_of(1));
  EXPECT_EQ((*table.rays)[1].size(), table.world.frames[0]->blobs.size());
}

TEST(RayTable, FindsWhichPointsAreInTheImage) {
  Table table;
  table.cast();
  std::uniform_real_distribution<double> flat(-6.0, 6.0);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const WorldPoint point{Vector3d(flat(table.random), flat(table.random), flat(table.random))};
    const auto pixel = geometry::project(table.rig[0], point);
    // Beyond 60 degrees the distortion polynomial folds the point back into the image; there the pixel is no oracle.
    const Vector3d seen = (table.rig[0].camera_from_world * point).v;
    const bool is_near_axis = seen.z() > 0.5 * seen.norm();

    const bool is_in_image = table.rays->is_in_image(0, point);

    EXPECT_EQ(is_in_image, is_near_axis && pixel && geometry::in_image(table.rig[0], *pixel)) << point.v.transpose();
    inside += is_in_image ? 1 : 0;
  }
  EXPECT_GT(inside, 50);
}

TEST(RayTable, HasNoRaysForAnEmptyView) {
  Table table;
  table.world.frames[1]->blobs.clear();

  table.cast();
  table.rays->list_unassigned(4.0);
  table.rays->project_gaussian({0.0, 0.0, 1.0}, Matrix3d::Identity(), 4.0, 1.0);

  EXPECT_EQ((*table.rays)[1].size(), 0U);
  EXPECT_EQ((*table.rays)[1].unassigned_count(), 0U);
  EXPECT_TRUE(unassigned((*table.rays)[1]).empty());
  EXPECT_FALSE(table.rays->nearest_unassigned(1));
  EXPECT_TRUE(table.rays->nearest_unassigned(0));
}

}  // namespace view_rays_test
}  // namespace mocap::associate
