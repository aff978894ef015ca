// The steps of solve_wand one by one, on a small simulated recording.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "calibration/wand/cross_validation.h"
#include "calibration/wand/initial_extrinsics.h"
#include "calibration/wand/solution_quality.h"
#include "calibration/wand/time_offset.h"
#include "calibration/wand/wand_detections.h"
#include "calibration/wand/wand_poses.h"
#include "geometry/rigid_fit.h"
#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace wand_steps_test {

const Wand kWand{{0.0, 0.16, 0.5}};
constexpr double kNoise_px = 0.1;

class WandSteps : public ::testing::Test {
 protected:
  WandSteps()
      : world_({.cameras = 4, .noise_px = kNoise_px, .seconds = 15.0, .rate_hz = 30.0, .body = false}, kWand, 3) {
    recording_ = world_.take();
  }

  WandDetections detect() {
    auto detections = detect_wands(recording_, world_.truth(), kWand, settings_);
    EXPECT_TRUE(detections) << detections.error().message;
    return *std::move(detections);
  }

  Bundle true_bundle() const { return {world_.truth(), kWand, {}, {}}; }

  simworld::WandWorld world_;
  Take recording_;
  WandSettings settings_;
};

TEST_F(WandSteps, DetectionFindsTheWandInMostImages) {
  const WandDetections detections = detect();

  ASSERT_EQ(detections.instants.size(), 450u);
  std::size_t found = 0;
  for (const auto& views : detections.views)
    found += static_cast<std::size_t>(std::ranges::count_if(views, [](const auto& view) { return view.has_value(); }));
  EXPECT_GT(found, 1000u);  // of 1800 images; the wand leaves some images, or is seen end on
  EXPECT_EQ(detections.image(0, 7), &recording_.cameras[0][7]);
}

TEST_F(WandSteps, InitialExtrinsicsAreAccurateToCentimetres) {
  const auto rig = initial_extrinsics(detect(), world_.truth(), kWand, settings_, 1.5, {});

  ASSERT_TRUE(rig) << rig.error().message;
  std::vector<geometry::PointPair> pairs;
  for (std::size_t c = 0; c < 4; ++c) pairs.push_back({(*rig)[c].centre().v, world_.truth()[c].centre().v});
  EXPECT_LT(geometry::fit_rigid(pairs)->rms_m, 0.05);
}

TEST_F(WandSteps, ACameraWithoutMirroredImagesPassesTheMirrorCheck) {
  EXPECT_FALSE(check_mirrored(detect(), world_.truth(), 1, kWand, settings_, 1.5));
}

TEST_F(WandSteps, TriangulatedWandPosesExplainTheObservations) {
  Bundle bundle = true_bundle();

  triangulate_wand_poses(detect(), bundle, {.gate_px = 3.0, .max_samples = 200});

  EXPECT_LE(bundle.wand_poses.size(), 200u);
  EXPECT_GT(bundle.wand_poses.size(), 150u);
  double squares = 0.0;
  for (const Observation& observation : bundle.observations)
    squares += bundle.residual_px(observation)->squaredNorm() / static_cast<double>(bundle.observations.size());
  EXPECT_LT(std::sqrt(squares / 2.0), 3.0 * kNoise_px);  // the wand poses are not adjusted yet
}

TEST_F(WandSteps, SamplesOfALongRecordingStayTogetherInBursts) {
  const WandDetections detections = detect();
  const std::vector<std::size_t> all = sample_instants(detections, {.max_samples = 1000});

  const std::vector<std::size_t> samples = sample_instants(detections, {.max_samples = 105, .burst = 10});

  ASSERT_EQ(samples.size(), 100u);
  EXPECT_LT(samples.front(), all[all.size() / 10]);
  EXPECT_GT(samples.back(), all[all.size() * 8 / 10]);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    EXPECT_GT(samples[i], samples[i - 1]);
    if (i % 10 == 0) continue;
    EXPECT_EQ(std::ranges::find(all, samples[i]) - std::ranges::find(all, samples[i - 1]), 1) << i;
  }
}

TEST_F(WandSteps, OutliersAreRemoved) {
  Bundle bundle = true_bundle();
  triangulate_wand_poses(detect(), bundle, {.gate_px = 3.0, .max_samples = 200});
  remove_outliers(bundle);
  bundle.observations[10].px.x() += 5.0;

  EXPECT_EQ(remove_outliers(bundle), 1u);
}

TEST_F(WandSteps, SynchronousCamerasHaveNoTimeOffset) {
  const auto offsets = estimate_time_offsets(detect(), true_bundle(), 3.0);

  ASSERT_EQ(offsets.size(), 4u);
  for (const TimeOffset& offset : offsets) {
    EXPECT_LT(std::abs(offset.late_s), 5.0 * offset.sigma_s + 1e-4);
    EXPECT_LT(offset.sigma_s, 1e-3);
  }
}

TEST(TimeOffset, ALateCameraIsNotHiddenByOneWithASmallOffsetThatIsKnownBetter) {
  const TimeOffset small{0.1e-3, 0.001e-3};  // 100 standard deviations, but not too large
  const TimeOffset late{5e-3, 0.2e-3};

  EXPECT_EQ(unsynchronised_camera(std::vector{small, late}), std::optional<std::size_t>(1));
  EXPECT_FALSE(unsynchronised_camera(std::vector{small, small}));
}

TEST(TimeOffset, TheLargestMultipleOfItsLimitIsNamed) {
  const TimeOffset certain{8e-3, 0.1e-3};   // 5.3 times its limit of 1.5 ms
  const TimeOffset uncertain{20e-3, 3e-3};  // 1.1 times its limit of 18 ms
  const TimeOffset unknown{0.0, std::numeric_limits<double>::infinity()};

  EXPECT_EQ(unsynchronised_camera(std::vector{unknown, uncertain, certain}), std::optional<std::size_t>(2));
  EXPECT_EQ(unsynchronised_camera(std::vector{unknown, uncertain}), std::optional<std::size_t>(1));
  EXPECT_FALSE(unsynchronised_camera(std::vector{unknown}));
}

TEST(TimeOffset, IsDeterminedOnlyIfEveryOffsetThatIsTooLargeWouldBeRefused) {
  for (const double sigma_s : {0.01e-3, 0.2e-3, 0.3e-3, 1e-3, 2e-3}) {
    const TimeOffset too_large{1.6e-3, sigma_s};
    EXPECT_EQ(is_determined(too_large), unsynchronised_camera(std::vector{too_large}).has_value()) << sigma_s;
  }
}

TEST_F(WandSteps, TheQualityOfATrueRigIsTheNoise) {
  Bundle bundle = true_bundle();
  triangulate_wand_poses(detect(), bundle, {.gate_px = 3.0, .max_samples = 300});
  BundleSettings poses_only;
  poses_only.fix_cameras = true;
  ASSERT_TRUE(adjust_bundle(bundle, poses_only));

  WandSolution solution = assess_solution(bundle, FreeIntrinsics::None);
  validate_held_out(solution, FreeIntrinsics::None, 1);

  EXPECT_NEAR(solution.rms_px, kNoise_px, 0.03);
  EXPECT_NEAR(solution.heldout_px.value_or(0.0), kNoise_px, 0.03);
  EXPECT_NEAR(solution.length_mean_m, 0.5, 2e-4);
  const auto markers = triangulated_markers_m(bundle);
  ASSERT_EQ(markers.size(), 3u);
  EXPECT_NEAR(markers[1], 0.16, 5e-4);
  EXPECT_EQ(triangulated_lengths_m(bundle).size(), solution.samples);
}

TEST_F(WandSteps, FiguresThatTheObservationsDoNotDetermineAreUnknown) {
  Bundle bundle = true_bundle();
  triangulate_wand_poses(detect(), bundle, {.gate_px = 3.0, .max_samples = 4});
  std::erase_if(bundle.observations, [](const Observation& observation) { return observation.camera == 3; });

  WandSolution solution = assess_solution(bundle, FreeIntrinsics::None);
  validate_held_out(solution, FreeIntrinsics::None, 1);

  EXPECT_FALSE(solution.cameras[0].uncertainty) << "the fourth camera is anywhere";
  EXPECT_FALSE(solution.heldout_px) << "one sample is held out";
  EXPECT_FALSE(solution.cameras[0].heldout_px);
}

}  // namespace wand_steps_test
}  // namespace mocap::calibration
