#include "lib/benchmark/skeleton_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "lib/benchmark/posed_clip.h"
#include "support/places.h"

namespace mocap::benchmark {
namespace skeleton_run_test {

Result<PosedClip> clip_of(const std::string& motion, const PosedClipSettings& settings) {
  return make_posed_clip(motion, support::source_folder() + "/config/markersets/baseline41.toml", settings);
}

// Root mean square distance of the markers from their places on the true bones, mm.
double tissue_mm(const PosedClip& posed) {
  double squares = 0.0;
  for (std::size_t frame = 0; frame < posed.clip.frames(); ++frame) {
    for (std::size_t m = 0; m < posed.clip.take.markers; ++m) {
      const MarkerOnBone& marker = posed.body.markers[m];
      const Pose& bone = posed.bones(frame)[marker.bone];
      squares += (posed.clip.take.frame(frame)[m] - bone * marker.offset_m).squaredNorm();
    }
  }
  return 1e3 * std::sqrt(squares / static_cast<double>(posed.clip.take.places_m.size()));
}

TEST(PosedClip, HasMarkersOnItsBonesUpToSoftTissue) {
  const auto rigid = clip_of("wave", {.seconds = 2.0, .rate_hz = 50.0});
  const auto soft = clip_of("wave", {.seconds = 60.0, .rate_hz = 50.0, .soft_tissue_mm = 8.0});
  ASSERT_TRUE(rigid && soft);

  EXPECT_EQ(rigid->clip.frames(), 250U);  // with 3 s of T-pose and transition
  EXPECT_EQ(rigid->begin, 150U);
  EXPECT_NEAR(tissue_mm(*rigid), 0.0, 1e-6);
  EXPECT_NEAR(tissue_mm(*soft), 8.0, 0.4);
}

TEST(PosedClip, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const PosedClipSettings settings{.seconds = 1.0, .marker_error_mm = 5.0, .soft_tissue_mm = 4.0};
  PosedClipSettings other = settings;
  other.seed = 2;
  const auto one = clip_of("wave", settings), again = clip_of("wave", settings), another = clip_of("wave", other);
  ASSERT_TRUE(one && again && another);

  EXPECT_EQ(one->clip.take.places_m, again->clip.take.places_m);
  EXPECT_NE(one->clip.take.places_m, another->clip.take.places_m);
}

TEST(PosedClip, ABodyHidesSomeMarkersFromFewCameras) {
  const auto hidden_share = [](int cameras) {
    const auto posed = clip_of("walk", {.seconds = 2.0, .rate_hz = 30.0, .occlusion_cameras = cameras});
    double hidden = 0.0;
    for (const Eigen::Vector3d& place_m : posed->clip.take.places_m) hidden += place_m.allFinite() ? 0.0 : 1.0;
    return hidden / static_cast<double>(posed->clip.take.places_m.size());
  };
  EXPECT_EQ(hidden_share(0), 0.0);
  EXPECT_GT(hidden_share(2), 0.2);
  EXPECT_LT(hidden_share(4), hidden_share(2));
}

TEST(PosedClip, RefusesAMotionWithoutBones) {
  EXPECT_FALSE(clip_of("fly:2", {}));
  EXPECT_FALSE(clip_of("missing.bvh", {}));
}

TEST(RunSkeleton, FollowsTheTrueBodyWithoutError) {
  const auto clip = clip_of("wave", {.seconds = 4.0});
  ASSERT_TRUE(clip);
  const auto figures = run_skeleton(*clip, SkeletonKnown::Given, {}, 1);

  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_EQ(figures->frames, 480U);
  EXPECT_EQ(figures->posed_share, 1.0);
  EXPECT_LT(figures->joint_cm, 0.1);
  EXPECT_LT(figures->rotation_deg, 1.0);
  ASSERT_EQ(figures->bones.size(), clip->body.skeleton.bones.size());
  EXPECT_EQ(figures->bones[0].bone, clip->body.skeleton.bones[0].name);
  EXPECT_GT(figures->ms_per_frame, 0.0);
}

TEST(RunSkeleton, KnowsALargerBodyOnlyWhereItIsGivenOrFitted) {
  const auto clip = clip_of("walk", {.seconds = 4.0, .size = 1.1});
  ASSERT_TRUE(clip);
  for (const SkeletonKnown mode : {SkeletonKnown::Given, SkeletonKnown::FirstFive, SkeletonKnown::All}) {
    const auto figures = run_skeleton(*clip, mode, {}, 1);
    ASSERT_TRUE(figures) << figures.error().message;
    EXPECT_LT(figures->joint_cm, 0.6) << kSkeletonModes[static_cast<std::size_t>(mode)];
  }
}

TEST(RunSkeleton, KeepsAPoseInSolverNoise) {
  const auto clip = clip_of("wave", {.seconds = 4.0});
  ASSERT_TRUE(clip);
  const auto figures = run_skeleton(*clip, SkeletonKnown::Given, *noise_named("solver"), 1);

  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_GT(figures->posed_share, 0.95);
  EXPECT_LT(figures->joint_cm, 2.0);
}

TEST(RunSkeleton, HasNoErrorWithoutAPose) {
  auto clip = clip_of("wave", {.seconds = 1.0, .rate_hz = 30.0});
  ASSERT_TRUE(clip);
  for (Eigen::Vector3d& place_m : clip->clip.take.places_m) place_m.setConstant(NAN);
  const auto figures = run_skeleton(*clip, SkeletonKnown::Given, {}, 1);

  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_EQ(figures->posed_share, 0.0);
  EXPECT_TRUE(std::isnan(figures->joint_cm) && std::isnan(figures->joint_p99_cm) && std::isnan(figures->rotation_deg));
}

TEST(SkeletonKnown, IsNamedAsItIsPrinted) {
  EXPECT_EQ(skeleton_mode_named("first5"), SkeletonKnown::FirstFive);
  EXPECT_FALSE(skeleton_mode_named("warm"));
}

}  // namespace skeleton_run_test
}  // namespace mocap::benchmark
