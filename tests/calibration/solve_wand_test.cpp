#include "calibration/wand/solve_wand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calibration/wand/wand_detections.h"
#include "calibration/wand/wand_poses.h"
#include "geometry/rigid_fit.h"
#include "lib/simworld/wand_world.h"

namespace mocap::calibration {
namespace solve_wand_test {

using simworld::WandWorld;
using simworld::WandWorldSettings;

const Wand kWand{{0.0, 0.16, 0.5}};

WandWorldSettings small_world() { return {.cameras = 5, .noise_px = 0.1, .seconds = 20.0, .rate_hz = 30.0}; }

// Rms error of the camera positions after a rigid alignment with the truth, m.
double position_error_m(const Rig& rig, const Rig& truth) {
  std::vector<geometry::PointPair> pairs;
  for (std::size_t c = 0; c < rig.size(); ++c) pairs.push_back({rig[c].centre().v, truth[c].centre().v});
  return geometry::fit_rigid(pairs)->rms_m;
}

double predicted_error_m(const WandSolution& solution) {
  double sum = 0.0;
  for (const CameraAccuracy& camera : solution.cameras)
    sum += camera.uncertainty.value().position_m * camera.uncertainty.value().position_m;
  return std::sqrt(sum / static_cast<double>(solution.cameras.size()));
}

// The images of the third camera are exposed one image later than their time stamps report.
Take late_by_an_image(Take take) {
  for (std::size_t i = 0; i + 1 < take.cameras[2].size(); ++i) take.cameras[2][i].spots = take.cameras[2][i + 1].spots;
  return take;
}

void expect_late_by_a_60th_second(const WandError& error) {
  EXPECT_EQ(error.fault, WandFault::NotSynchronous) << error.message;
  const std::size_t at = error.message.find("'cam3': its images are about ");
  ASSERT_NE(at, std::string::npos) << error.message;
  EXPECT_NEAR(std::stod(error.message.substr(at + 29)), 16.7, 1.5) << error.message;
  EXPECT_NE(error.message.find("ms later than"), std::string::npos) << error.message;
}

TEST(SolveWand, FindsTheCamerasWithinWhatTheNoiseAllows) {
  WandWorld world(small_world(), kWand, 1);

  const auto solution = solve_wand(world.take(), world.truth(), kWand, {});

  ASSERT_TRUE(solution) << solution.error().message;
  EXPECT_LT(solution->rms_px, 0.105);
  EXPECT_GT(solution->rms_px, 0.075);  // the degrees of freedom of the solution absorb a part of the noise
  EXPECT_LT(position_error_m(solution->bundle.rig, world.truth()), 1e-3);
  EXPECT_NEAR(solution->length_mean_m, 0.5, 1e-4);
}

TEST(SolveWand, EstimatesUnknownLenses) {
  WandWorld world(small_world(), kWand, 2);
  const Rig rough = world.rough_lenses(0.2);
  WandSettings settings;
  settings.lens_known = false;

  const auto solution = solve_wand(world.take(), rough, kWand, settings);

  ASSERT_TRUE(solution) << solution.error().message;
  EXPECT_LT(solution->rms_px, 0.105);
  EXPECT_GT(solution->rms_px, 0.075);  // the degrees of freedom of the solution absorb a part of the noise
  EXPECT_LT(position_error_m(solution->bundle.rig, world.truth()), 5e-3);
  for (std::size_t c = 0; c < rough.size(); ++c) {
    const double found = solution->bundle.rig[c].lens.fx_px;
    EXPECT_NEAR(found / world.truth()[c].lens.fx_px, 1.0, 3e-3)
        << "camera " << c << ", started at " << rough[c].lens.fx_px;
  }
}

TEST(SolveWand, SolvesASymmetricWandOfTwoMarkers) {
  const Wand two{{0.0, 0.5}};
  WandWorld world(small_world(), two, 3);

  const auto solution = solve_wand(world.take(), world.truth(), two, {});

  ASSERT_TRUE(solution) << solution.error().message;
  EXPECT_LT(solution->rms_px, 0.105);
  EXPECT_GT(solution->rms_px, 0.075);  // the degrees of freedom of the solution absorb a part of the noise
  EXPECT_LT(position_error_m(solution->bundle.rig, world.truth()), 1.5e-3);
}

TEST(SolveWand, IsDeterministic) {
  WandWorld world(small_world(), kWand, 4);
  const Take take = world.take();

  const auto one = solve_wand(take, world.truth(), kWand, {.threads = 1});
  const auto other = solve_wand(take, world.truth(), kWand, {.threads = 1});

  ASSERT_TRUE(one && other);
  for (std::size_t c = 0; c < world.truth().size(); ++c)
    EXPECT_EQ(one->bundle.rig[c].centre().v, other->bundle.rig[c].centre().v);
}

TEST(SolveWand, PredictsItsOwnError) {
  double predicted = 0.0;
  double found = 0.0;
  for (std::uint64_t seed = 10; seed < 22; ++seed) {
    WandWorld world({.cameras = 4, .noise_px = 0.2, .seconds = 10.0, .rate_hz = 20.0}, kWand, seed);
    const auto solution = solve_wand(world.take(), world.truth(), kWand, {});
    ASSERT_TRUE(solution) << "seed " << seed << ": " << solution.error().message;
    predicted += std::pow(predicted_error_m(*solution), 2);
    found += std::pow(position_error_m(solution->bundle.rig, world.truth()), 2);
  }
  // 12 worlds with 24 - 6 degrees of freedom: the ratio has a standard deviation of 5 %.
  EXPECT_NEAR(std::sqrt(predicted / found), 1.0, 0.25);
}

TEST(SolveWand, NamesACameraWithoutSharedSamples) {
  WandWorld world(small_world(), kWand, 5);
  Take take = world.take();
  // The fourth camera sees the wand only while no other does.
  for (std::size_t c = 0; c < take.cameras.size(); ++c) {
    const std::size_t third = take.cameras[c].size() / 3;
    for (std::size_t i = 0; i < take.cameras[c].size(); ++i) {
      if ((c == 3) != (i < third)) take.cameras[c][i].spots.clear();
    }
  }

  const auto solution = solve_wand(take, world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::NoOverlap);
  EXPECT_NE(solution.error().message.find("'cam4'"), std::string::npos) << solution.error().message;
}

TEST(SolveWand, RefusesARecordingWithTooFewSamples) {
  WandWorldSettings settings = small_world();
  settings.seconds = 1.0;
  WandWorld world(settings, kWand, 6);

  const auto solution = solve_wand(world.take(), world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::TooFewSamples);
}

TEST(SolveWand, RefusesAWandWithAnotherDivisionRatio) {
  WandWorld world(small_world(), Wand{{0.0, 0.25, 0.5}}, 7);

  const auto solution = solve_wand(world.take(), world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::WrongWand);
  EXPECT_NE(solution.error().message.find("expected 0.32"), std::string::npos) << solution.error().message;
}

TEST(SolveWand, RefusesTwoWands) {
  WandWorld world(small_world(), kWand, 8);
  WandWorld second(small_world(), kWand, 9);
  Take take = world.take();
  const Take other = second.take();
  for (std::size_t c = 0; c < take.cameras.size(); ++c) {
    for (std::size_t i = 0; i < take.cameras[c].size(); ++i) {
      const auto& more = other.cameras[c][i].spots;
      take.cameras[c][i].spots.insert(take.cameras[c][i].spots.end(), more.begin(), more.end());
    }
  }

  const auto solution = solve_wand(take, world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::TwoWands);
}

TEST(SolveWand, RefusesAStationaryWand) {
  WandWorld world(small_world(), kWand, 10);
  Take take = world.take();
  for (auto& pictures : take.cameras) {
    for (Picture& picture : pictures) picture.spots = pictures.front().spots;
  }

  const auto solution = solve_wand(take, world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::StillWand) << solution.error().message;
}

TEST(SolveWand, MeasuresTheTimeOffsetOfACamera) {
  WandWorldSettings settings = small_world();
  settings.rate_hz = 60.0;
  WandWorld world(settings, kWand, 11);

  const auto solution = solve_wand(late_by_an_image(world.take()), world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  expect_late_by_a_60th_second(solution.error());
}

TEST(SolveWand, MeasuresATimeOffsetInALongRecording) {
  WandWorldSettings settings = small_world();
  settings.rate_hz = 60.0;
  settings.seconds = 120.0;
  WandWorld world(settings, kWand, 16);
  Take take = late_by_an_image(world.take());
  // 3600 instants at 30 Hz: thinned out evenly, no two samples would be near enough for a velocity.
  for (std::vector<Picture>& pictures : take.cameras) {
    for (std::size_t i = 1; 2 * i < pictures.size(); ++i) pictures[i] = pictures[2 * i];
    pictures.resize(pictures.size() / 2);
  }

  const auto solution = solve_wand(take, world.truth(), kWand, {});

  ASSERT_FALSE(solution);
  expect_late_by_a_60th_second(solution.error());
}

TEST(SolveWand, MeasuresATimeOffsetWithASymmetricWand) {
  const Wand two{{0.0, 0.5}};
  WandWorldSettings settings = small_world();
  settings.rate_hz = 60.0;
  WandWorld world(settings, two, 17);
  Take take = late_by_an_image(world.take());
  // A detector finds the blobs in any order, so the ends of the wand are exchanged from image to image.
  for (std::vector<Picture>& pictures : take.cameras) {
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      if (i * 7 % 5 < 2) std::ranges::reverse(pictures[i].spots);
    }
  }

  const auto solution = solve_wand(take, world.truth(), two, {});

  ASSERT_FALSE(solution);
  expect_late_by_a_60th_second(solution.error());
}

TEST(SolveWand, SaysWhetherTheSynchronisationWasChecked) {
  WandWorldSettings settings = small_world();
  settings.cameras = 3;
  WandWorld three(settings, kWand, 18);
  settings.cameras = 2;
  WandWorld two(settings, kWand, 18);

  const auto checked = solve_wand(three.take(), three.truth(), kWand, {});
  const auto unchecked = solve_wand(two.take(), two.truth(), kWand, {});

  ASSERT_TRUE(checked) << checked.error().message;
  for (const CameraAccuracy& camera : checked->cameras) EXPECT_TRUE(camera.synchronisation_checked);
  ASSERT_TRUE(unchecked) << unchecked.error().message;
  for (const CameraAccuracy& camera : unchecked->cameras) {
    EXPECT_FALSE(camera.synchronisation_checked) << "no second camera triangulates the wand";
    EXPECT_TRUE(camera.uncertainty) << "the wand determines the pose of two cameras";
  }
}

TEST(SolveWand, DoesNotAccuseACameraOfWhichNoSampleIsDrawn) {
  WandWorldSettings settings = small_world();
  settings.rate_hz = 60.0;
  WandWorld world(settings, kWand, 19);
  Take take = world.take();
  WandSettings quick;
  quick.max_samples = 400;
  Take others = take;
  others.cameras.pop_back();
  const Rig rig_of_others(world.truth().begin(), world.truth().end() - 1);
  const auto detections = detect_wands(others, rig_of_others, kWand, quick);
  ASSERT_TRUE(detections) << detections.error().message;
  const std::size_t all = detections->instants.size();
  std::vector<bool> is_seen(all, false);
  for (const std::size_t i : sample_instants(*detections, {.max_samples = all})) is_seen[i] = true;
  for (const std::size_t i : sample_instants(*detections, {.max_samples = 400})) is_seen[i] = false;
  ASSERT_EQ(take.cameras.back().size(), all) << "one image for each instant";
  for (std::size_t i = 0; i < all; ++i) {
    if (!is_seen[i]) take.cameras.back()[i].spots.clear();
  }

  const auto solution = solve_wand(take, world.truth(), kWand, quick);

  ASSERT_TRUE(solution) << solution.error().message;
  EXPECT_EQ(solution->cameras.back().points, 0u);
}

TEST(SolveWand, RefusesALensFileOfAnotherImageSize) {
  WandWorld world(small_world(), kWand, 12);
  Rig small = world.truth();
  for (CameraModel& camera : small) {
    camera.width_px /= 2;
    camera.height_px /= 2;
  }

  const auto solution = solve_wand(world.take(), small, kWand, {});

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().fault, WandFault::WrongImageSize);
}

TEST(SolveWand, IsCancelledByTheProgressCallback) {
  WandWorld world(small_world(), kWand, 13);

  const auto solution = solve_wand(world.take(), world.truth(), kWand, {}, [](const char*, double) { return false; });

  EXPECT_FALSE(solution);
}

TEST(SolveWand, JudgesNothingAfterACancellation) {
  WandWorldSettings settings = small_world();
  settings.rate_hz = 60.0;
  WandWorld world(settings, kWand, 11);
  const auto until_adjusting = [](const char* step, double) { return std::string(step) != "adjusting"; };

  const auto solution = solve_wand(late_by_an_image(world.take()), world.truth(), kWand, {}, until_adjusting);

  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().message, kCancelled);
}

TEST(SolveWand, MeasuresTheResidualOfHeldOutSamples) {
  WandWorld world(small_world(), kWand, 13);

  const auto solution = solve_wand(world.take(), world.truth(), kWand, {});

  ASSERT_TRUE(solution) << solution.error().message;
  // With many samples both residuals are equal; the rms of one sample in ten has a standard deviation of 2 %.
  ASSERT_TRUE(solution->heldout_px);
  EXPECT_NEAR(*solution->heldout_px / solution->rms_px, 1.0, 0.1);
  std::size_t held_out = 0;
  double squares = 0.0;
  for (const ObservationResidual& one : solution->residuals) {
    held_out += one.held_out ? 1 : 0;
    squares += one.held_out ? one.residual_px.squaredNorm() : 0.0;
  }
  EXPECT_NEAR(static_cast<double>(held_out) / static_cast<double>(solution->bundle.observations.size()), 0.1, 0.02);
  EXPECT_EQ(solution->residuals.size(), solution->bundle.observations.size() + held_out);
  EXPECT_NEAR(*solution->heldout_px, std::sqrt(squares / (2.0 * static_cast<double>(held_out))), 1e-12);
}

TEST(SolveWand, HeldOutSamplesRevealAnOverfittedLens) {
  WandWorldSettings settings = small_world();
  settings.cameras = 3;
  settings.seconds = 4.0;
  WandWorld world(settings, kWand, 14);
  WandSettings wanted;
  wanted.refine_lens = true;

  const auto solution = solve_wand(world.take(), world.truth(), kWand, wanted);

  ASSERT_TRUE(solution) << solution.error().message;
  EXPECT_GT(solution->heldout_px.value_or(0.0), 1.05 * solution->rms_px);
}

}  // namespace solve_wand_test
}  // namespace mocap::calibration
