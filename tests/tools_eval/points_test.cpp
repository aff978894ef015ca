#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "eval/marker_pipeline.h"
#include "eval/points_score.h"
#include "lib/simworld/points_motion.h"
#include "lib/simworld/points_visibility.h"
#include "lib/simworld/points_world.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::eval {
namespace points_test {

PointsScore run(const simworld::PointMotion& motion, const simworld::WorldSettings& settings, int sets,
                std::uint64_t seed) {
  PointsScore score;
  simworld::PointsWorld world(settings, motion, seed);
  MarkerPipeline pipeline(world.rig());
  PointsScorer scorer(world.rig(), settings.noise_px, score);
  for (int set = 0; set < sets; ++set) {
    const simworld::SeenInstant& seen = world.next();
    if (pipeline.step(seen))
      scorer.add(seen, pipeline.matches(), pipeline.markers(), pipeline.predicted(), pipeline.tracked());
  }
  return score;
}

double ratio_to_bound(const PointsScore& score) {
  return std::sqrt(score.squared_error_m2.mean() / score.bound_m2.mean());
}

TEST(EvalPoints, FindsEveryMarkerOfASwarmAtTheBoundOfTheGeometry) {
  const auto swarm = simworld::make_swarm(30, 5);
  for (const double noise_px : {0.05, 0.3}) {
    simworld::WorldSettings settings;
    settings.noise_px = noise_px;

    const PointsScore score = run(*swarm, settings, 150, 3);

    EXPECT_EQ(score.seen_by_3plus.found, score.seen_by_3plus.of);
    // 4500 points with three axes each: the standard deviation of the ratio is 0.6 %.
    EXPECT_NEAR(ratio_to_bound(score), 1.0, 0.03) << noise_px << " px";
    // The goal is 10 %. The learned rig error cannot be negative, so the reported covariance is slightly too large.
    EXPECT_NEAR(score.nees.mean(), 3.0, 0.3) << noise_px << " px";
    EXPECT_EQ(score.id_changes, 0U);
    EXPECT_EQ(score.ghosts, 0U);
  }
}

TEST(EvalPoints, TheBoundGrowsWithTheNoiseAndShrinksWithTheCameras) {
  const auto swarm = simworld::make_swarm(20, 5);
  const auto bound_mm = [&](int cameras, double noise_px) {
    simworld::WorldSettings settings;
    settings.cameras = cameras;
    settings.noise_px = noise_px;
    return 1000.0 * std::sqrt(run(*swarm, settings, 20, 9).bound_m2.mean());
  };

  EXPECT_NEAR(bound_mm(8, 0.2) / bound_mm(8, 0.1), 2.0, 1e-6);
  // About the square root of the number of cameras; not exactly, because the rings differ.
  EXPECT_NEAR(bound_mm(4, 0.1) / bound_mm(16, 0.1), 2.0, 0.4);
}

TEST(EvalPoints, FalseBlobsMissesAndLostImagesCreateNoGhostTrack) {
  const auto swarm = simworld::make_swarm(40, 8);
  simworld::WorldSettings settings;
  settings.false_blobs = 0.1;
  settings.misses = 0.05;
  settings.lost_frames = 0.02;
  settings.jitter_us = 50.0;

  const PointsScore score = run(*swarm, settings, 200, 4);

  EXPECT_GE(score.seen_by_3plus.value(), 0.999);
  EXPECT_EQ(score.ghosts, 0U);
  EXPECT_EQ(score.id_changes, 0U);
}

TEST(EvalPoints, TheSameSeedGivesTheSameWorldAndAnotherADifferentOne) {
  const auto swarm = simworld::make_swarm(10, 2);
  simworld::WorldSettings settings;
  settings.visibility = simworld::Visibility::Measured;
  const PointsScore a = run(*swarm, settings, 50, 6);
  const PointsScore b = run(*swarm, settings, 50, 6);
  const PointsScore c = run(*swarm, settings, 50, 7);

  EXPECT_EQ(a.squared_error_m2.total, b.squared_error_m2.total);
  EXPECT_EQ(a.views, b.views);
  EXPECT_NE(a.squared_error_m2.total, c.squared_error_m2.total);
}

TEST(EvalPoints, BlobsThatTouchMergeAtTheirMeanPosition) {
  const auto swarm = simworld::make_swarm(60, 3);
  simworld::WorldSettings settings;
  settings.merge = true;
  simworld::PointsWorld world(settings, *swarm, 1);

  const simworld::SeenInstant& seen = world.next();

  int merged = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    std::size_t alone = 0;
    std::size_t shared = 0;
    for (std::size_t i = 0; i < seen.lights.size(); ++i) {
      alone += seen.alone_in[i] >> c & 1;
      shared += seen.merged_in[i] >> c & 1;
    }
    const std::size_t blobs = seen.frames[c]->blobs.size();
    EXPECT_GE(blobs, alone + (shared + 2) / 3);
    EXPECT_LE(blobs, alone + shared / 2);
    merged += static_cast<int>(shared);
    for (const Blob& blob : seen.frames[c]->blobs) EXPECT_GT(blob.area_px2, 1.0);
  }
  EXPECT_GE(merged, 5);
}

TEST(EvalPoints, HidesMarkersAsOftenAndAsLongAsRealCamerasDo) {
  constexpr std::size_t kLights = 200;
  simworld::VisibilityModel model(simworld::Visibility::Measured, 1, kLights, 11);
  std::vector<int> hidden_for(kLights, 0);
  std::vector<int> runs;
  double seen = 0.0;
  constexpr int kSets = 6000;
  for (int set = 0; set < kSets; ++set) {
    model.advance(0.01);
    for (std::size_t i = 0; i < kLights; ++i) {
      if (model.sees(0, i)) {
        seen += 1.0;
        if (hidden_for[i] > 0) runs.push_back(hidden_for[i]);
        hidden_for[i] = 0;
      } else {
        ++hidden_for[i];
      }
    }
  }
  std::sort(runs.begin(), runs.end());

  EXPECT_NEAR(seen / (kSets * kLights), 0.63, 0.05);
  // Measured on recordings: 2 to 6 sets in the median, 30 to 200 sets at the 90th percentile.
  EXPECT_GE(runs[runs.size() / 2], 2);
  EXPECT_LE(runs[runs.size() / 2], 6);
  EXPECT_GE(runs[runs.size() * 9 / 10], 30);
  EXPECT_LE(runs[runs.size() * 9 / 10], 200);
}

TEST(EvalPoints, ReadsTrcAndReportsTheFaultsOfOtherFiles) {
  const support::TemporaryFolder folder;
  const std::string trc = (folder.path() / "two.trc").string();
  std::ofstream(trc) << "PathFileType\t4\t(X/Y/Z)\ttwo.trc\n"
                        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
                        "50.00\t50.00\t2\t2\tmm\n"
                        "Frame#\tTime\tA\t\t\tB\t\t\n"
                        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
                        "1\t0.00\t100\t200\t1000\t0\t0\t1500\n"
                        "2\t0.02\t110\t200\t1000\t\t\t\n";
  const auto motion = simworld::load_motion(trc, 0);
  ASSERT_TRUE(motion) << motion.error().message;
  std::vector<simworld::Light> lights;
  (*motion)->at(0.0, lights);
  ASSERT_EQ(lights.size(), 2U);
  EXPECT_NEAR((lights[0].position - lights[1].position).norm(), std::hypot(0.1, 0.2, 0.5), 1e-9);
  (*motion)->at(0.02, lights);
  EXPECT_TRUE(lights[0].there);
  EXPECT_FALSE(lights[1].there);

  EXPECT_EQ(simworld::load_motion((folder.path() / "none.c3d").string(), 0).error().code, ErrorCode::NotFound);
  std::ofstream(folder.path() / "empty.trc") << "nothing\n";
  EXPECT_EQ(simworld::load_motion((folder.path() / "empty.trc").string(), 0).error().code, ErrorCode::InvalidArgument);
}

// Number of identity changes in recorded motion that all cameras see.
std::uint64_t id_changes(const std::string& file, double rate_hz, std::uint64_t seed) {
  const auto motion = simworld::load_motion(support::shared_data_folder() + "/c3d/" + file, 0);
  if (!motion) return 9999;
  simworld::WorldSettings settings;
  settings.rate_hz = rate_hz;
  return run(**motion, settings, static_cast<int>((*motion)->length_s() * rate_hz) + 1, seed).id_changes;
}

TEST(EvalPoints, KeepsAllIdentitiesInRecordedMotionThatAllCamerasSee) {
  if (!std::ifstream(support::shared_data_folder() + "/c3d/btk_optitrack36_100.c3d")) {
    GTEST_SKIP() << "no motion data at " << support::shared_data_folder();
  }
  for (const double rate_hz : {100.0, 25.0}) {
    EXPECT_EQ(id_changes("btk_pig_walk_fullbody_100.c3d", rate_hz, 21), 0U) << rate_hz << " Hz";
    EXPECT_EQ(id_changes("btk_optitrack36_100.c3d", rate_hz, 21), 0U) << rate_hz << " Hz";
  }
  // Only unlabelled points of the recording have gaps. A constant-velocity tracker has 46 identity changes.
  EXPECT_LE(id_changes("pycgm_movement_42unlabelled_120.c3d", 120.0, 21), 23U);
}

}  // namespace points_test
}  // namespace mocap::eval
