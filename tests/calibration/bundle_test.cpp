#include "calibration/bundle.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "calibration/bundle_problem.h"
#include "calibration/distort_ray.h"
#include "calibration/robust_statistics.h"
#include "geometry/lens.h"
#include "scene/random.h"
#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace bundle_test {

using Eigen::Vector3d;

// Exact observations of a wand in random poses.
Bundle exact_bundle(int cameras, int wand_poses) {
  scene::Random random(5);
  Bundle bundle;
  bundle.rig = scene::ring_rig({.cameras = cameras});
  bundle.wand.marks_m = {0.0, 0.16, 0.5};
  for (int p = 0; p < wand_poses; ++p) {
    WandPose& pose = bundle.wand_poses.emplace_back();
    pose.middle_m = {random.uniform() - 0.5, random.uniform() - 0.5, 0.7 + 0.6 * random.uniform()};
    pose.direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    for (int c = 0; c < cameras; ++c) {
      for (int m = 0; m < 3; ++m) {
        const auto px = geometry::project(bundle.rig[static_cast<std::size_t>(c)], bundle.marker_position(pose, m));
        bundle.observations.push_back({c, p, m, px->v, 0.1});
      }
    }
  }
  return bundle;
}

TEST(DistortRay, EqualsTheGeometryOfTheDaemon) {
  Lens pinhole{LensKind::Pinhole, 900.0, 905.0, 640.0, 500.0, {}};
  pinhole.distortion << -0.2, 0.07, 4e-4, -5e-4, 0.02;
  Lens fisheye{LensKind::Fisheye, 400.0, 402.0, 630.0, 510.0, {}};
  fisheye.distortion << 0.03, -0.01, 0.003, -0.0005, 0.0;
  for (const Lens& lens : {pinhole, fisheye}) {
    const double intrinsics[9] = {lens.fx_px,         lens.fy_px,         lens.cx_px,
                                  lens.cy_px,         lens.distortion[0], lens.distortion[1],
                                  lens.distortion[2], lens.distortion[3], lens.distortion[4]};
    for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.4, -0.3)}) {
      Eigen::Vector2d px;

      distort_ray(lens.kind, intrinsics, ray.x(), ray.y(), px.data());

      EXPECT_LT((px - geometry::distort(lens, {ray}).v).norm(), 1e-9);
    }
  }
}

TEST(RobustStatistics, TheRayleighMedianIsThatOfTheDistribution) {
  EXPECT_NEAR(kRayleighMedian, std::sqrt(2.0 * std::numbers::ln2), 1e-4);
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 2.0, 3.0}), 3.0);  // the upper of the middle two
}

TEST(AdjustBundle, RecoversPerturbedCamerasFromExactObservations) {
  const Bundle truth = exact_bundle(4, 40);
  Bundle bundle = truth;
  scene::Random random(6);
  for (std::size_t c = 1; c < 4; ++c) {
    bundle.rig[c].camera_from_world.translation += 0.02 * Vector3d(random.normal(), random.normal(), random.normal());
  }
  for (WandPose& pose : bundle.wand_poses)
    pose.middle_m += 0.02 * Vector3d(random.normal(), random.normal(), random.normal());

  ASSERT_TRUE(adjust_bundle(bundle, {}));

  EXPECT_LT((bundle.rig[0].centre().v - truth.rig[0].centre().v).norm(), 1e-12);  // m; fixed, up to rounding
  for (std::size_t c = 1; c < 4; ++c)
    EXPECT_LT((bundle.rig[c].centre().v - truth.rig[c].centre().v).norm(), 1e-4) << c;  // m, tolerance of the cost
  for (const Observation& observation : bundle.observations) EXPECT_LT(bundle.residual_px(observation)->norm(), 0.01);
}

TEST(AdjustBundle, StopsIfTheCallbackReturnsFalse) {
  Bundle bundle = exact_bundle(3, 20);
  bundle.rig[1].camera_from_world.translation.x() += 0.05;
  int calls = 0;

  EXPECT_TRUE(adjust_bundle(bundle, {}, [&](int) { return ++calls < 2; }));

  EXPECT_EQ(calls, 2);
}

TEST(RigCovariance, IsFreeOfMotionsOfTheWholeRig) {
  const Bundle bundle = exact_bundle(4, 40);

  const RigCovariance result = rig_covariance(bundle, FreeIntrinsics::None, 1.0);

  ASSERT_EQ(result.covariance.rows(), 24);
  // A translation of all centres has no variance.
  Eigen::MatrixXd translation = Eigen::MatrixXd::Zero(24, 3);
  for (int c = 0; c < 4; ++c) translation.middleRows<3>(6 * c).setIdentity();
  EXPECT_LT((result.covariance * translation).norm(), 1e-9 * result.covariance.norm());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(result.covariance);
  EXPECT_LT(eigen.eigenvalues()[5], 1e-9 * eigen.eigenvalues()[23]);
  EXPECT_GT(eigen.eigenvalues()[6], 1e-9 * eigen.eigenvalues()[23]);
}

TEST(RigCovariance, TwoCamerasAreDeterminedUpToARotationAboutTheLineBetweenThem) {
  const Bundle bundle = exact_bundle(2, 40);

  const RigCovariance result = rig_covariance(bundle, FreeIntrinsics::None, 1.0);

  ASSERT_EQ(result.covariance.rows(), 12);
  const Vector3d line = (bundle.rig[1].centre().v - bundle.rig[0].centre().v).normalized();
  Eigen::VectorXd turn = Eigen::VectorXd::Zero(12);
  turn.segment<3>(3) = turn.segment<3>(9) = line;
  EXPECT_LT(turn.dot(result.covariance * turn), 1e-9 * result.covariance.trace());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(result.covariance);
  EXPECT_GT(eigen.eigenvalues()[6], 1e-9 * eigen.eigenvalues()[11]) << "six relative degrees of freedom";
  ASSERT_EQ(result.cameras.size(), 2u);
  EXPECT_LT(result.cameras[0].position_m, 0.01) << "0.1 px in 40 wand poses";
}

TEST(RigCovariance, IsEmptyForACameraWithoutObservations) {
  Bundle bundle = exact_bundle(3, 20);
  std::erase_if(bundle.observations, [](const Observation& observation) { return observation.camera == 2; });

  EXPECT_EQ(rig_covariance(bundle, FreeIntrinsics::None, 1.0).covariance.size(), 0);
  EXPECT_FALSE(BundleProblem(bundle, {}).has_camera(2));
}

TEST(BundleProblem, ListsTheFreeIntrinsics) {
  EXPECT_TRUE(free_intrinsic_indices(FreeIntrinsics::None, LensKind::Pinhole).empty());
  EXPECT_EQ(free_intrinsic_indices(FreeIntrinsics::FocalLengthsAndK1, LensKind::Pinhole), (std::vector<int>{0, 1, 4}));
  EXPECT_EQ(free_intrinsic_indices(FreeIntrinsics::All, LensKind::Fisheye).size(), 8u);
}

}  // namespace bundle_test
}  // namespace mocap::calibration
