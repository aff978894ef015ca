#include "lib/benchmark/skeleton_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "lib/benchmark/skeleton_errors.h"
#include "lib/benchmark/skeleton_run.h"
#include "support/places.h"

namespace mocap::benchmark {
namespace skeleton_bound_test {

PosedClip clip_of(double soft_tissue_mm, const std::string& marker_set = "baseline41") {
  auto clip = make_posed_clip("walk", support::source_folder() + "/config/markersets/" + marker_set + ".toml",
                              {.seconds = 4.0, .soft_tissue_mm = soft_tissue_mm});
  EXPECT_TRUE(clip);
  return *std::move(clip);
}

TEST(SkeletonBound, IsTheErrorOfAMarkerForARigidBodyOfOne) {
  PosedClip clip = clip_of(8.0);
  clip.body.skeleton.bones.resize(1);
  clip.body.markers.resize(1);
  clip.body.markers[0] = {.name = "only", .bone = 0, .offset_m = Eigen::Vector3d::Zero()};
  clip.clip.take.markers = 1;
  clip.clip.take.places_m.assign(600, Eigen::Vector3d::Zero());
  clip.poses.assign(600, Pose{});
  clip.begin = 0;

  // Its rotation is not observed, so there is no bound: at least three markers determine a pose.
  EXPECT_TRUE(std::isnan(skeleton_bound(clip, {}, 1).joint_cm));

  clip.body.markers = {{.name = "x", .bone = 0, .offset_m = {0.1, 0.0, 0.0}},
                       {.name = "y", .bone = 0, .offset_m = {-0.05, 0.0866, 0.0}},
                       {.name = "z", .bone = 0, .offset_m = {-0.05, -0.0866, 0.0}}};
  clip.clip.take.markers = 3;
  clip.clip.take.places_m.assign(1800, Eigen::Vector3d::Zero());
  const SkeletonFigures bound = skeleton_bound(clip, {}, 1);

  // The mean of three markers: s^2 (1 + 1/3) in each axis; the mean length of a normal vector is sqrt(8 / pi) sigma.
  const double sigma_m = soft_tissue_sigma_m(8.0);
  EXPECT_NEAR(bound.joint_cm, 100.0 * std::sqrt(8.0 / std::numbers::pi * 4.0 / 3.0) * sigma_m, 0.02);
  EXPECT_GT(bound.rotation_deg, 0.0);
}

TEST(SkeletonBound, GrowsWithTheSoftTissueAndWithHiddenMarkers) {
  const SkeletonFigures none = skeleton_bound(clip_of(0.0), {}, 1), four = skeleton_bound(clip_of(4.0), {}, 1),
                        eight = skeleton_bound(clip_of(8.0), {}, 1),
                        hidden = skeleton_bound(clip_of(8.0), *noise_named("solver"), 1);

  EXPECT_LT(none.joint_cm, 0.001);
  EXPECT_NEAR(eight.joint_cm, 2.0 * four.joint_cm, 0.05);
  EXPECT_GT(hidden.joint_cm, 1.1 * eight.joint_cm);
  EXPECT_GT(eight.joint_p99_cm, 2.0 * eight.joint_cm);
}

TEST(SkeletonBound, IsBelowTheErrorsOfTheDaemon) {
  const PosedClip clip = clip_of(8.0);
  const auto measured = run_skeleton(clip, SkeletonKnown::Given, {}, 1),
             bound = run_skeleton(clip, SkeletonKnown::Bound, {}, 1);
  ASSERT_TRUE(measured && bound);

  EXPECT_LT(bound->joint_cm, measured->joint_cm);
  EXPECT_LT(measured->joint_cm, 1.3 * bound->joint_cm);
}

TEST(SkeletonErrors, AreMeansOverTheBonesThatHaveAPose) {
  Skeleton skeleton;
  skeleton.bones.resize(2);
  SkeletonErrors errors(skeleton);
  const Pose truth[2];
  SubjectPose pose;
  pose.bones.resize(2);
  pose.bones[0].state = BoneState::Measured;
  pose.bones[0].world_from_bone.position = {0.02, 0.0, 0.0};

  errors.add(pose, truth);
  const SkeletonFigures figures = errors.figures(2);

  EXPECT_NEAR(figures.joint_cm, 2.0, 1e-9);
  EXPECT_EQ(figures.posed_share, 0.5);
  EXPECT_NEAR(figures.rotation_deg, 0.0, 1e-9);
}

}  // namespace skeleton_bound_test
}  // namespace mocap::benchmark
