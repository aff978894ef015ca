#include "lib/benchmark/label_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "lib/benchmark/labelled_clip.h"
#include "lib/benchmark/point_pipeline.h"
#include "lib/benchmark/withheld.h"
#include "lib/simworld/trc_file.h"
#include "scene/procedural_actor.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::benchmark {
namespace label_run_test {

// A person with known markers who waves; 4 s at 100 Hz.
LabelledClip waving() {
  const auto set = settings::load_marker_set(support::source_folder() + "/config/markersets/baseline41.toml");
  const auto actor = scene::make_procedural_actor(*set, *scene::parse_program("tpose:1,wave"));
  LabelledClip clip;
  clip.name = "waving";
  clip.rate_hz = 100.0;
  clip.marker_set = *set;
  clip.take.markers = set->markers.size();
  scene::ActorState state;
  for (int frame = 0; frame < 400; ++frame) {
    actor->at(0.01 * frame, state);
    for (const scene::ActorMarker& marker : state.markers) clip.take.places_m.push_back(marker.position.v);
  }
  return clip;
}

TEST(RunLabels, LabelsAPersonWithAndWithoutNoise) {
  const LabelledClip clip = waving();
  for (const char* noise : {"none", "soma", "cuts50"}) {
    const auto run = run_labels(clip, {BodyKnown::Given, *noise_named(noise), 1, nullptr});

    ASSERT_TRUE(run) << run.error().message;
    EXPECT_GT(*run->since_first.macro_f1, 0.98) << noise;
    EXPECT_EQ(run->figures.longest_wrong_frames, 0U) << noise;
    EXPECT_EQ(run->figures.frames, 400U);
    EXPECT_GT(run->ms_per_frame, 0.0);
  }
}

TEST(RunLabels, ABodyThatIsOnlyCalibratedIsFoundWhenItReturns) {
  const auto run = run_labels(waving(), {BodyKnown::Calibrated, {}, 1, nullptr});

  ASSERT_TRUE(run) << run.error().message;
  EXPECT_GT(*run->since_first.label_recall, 0.99);
  EXPECT_EQ(run->figures.wrong, 0U);
}

TEST(RunLabels, AColdClipWithoutATPoseIsLabelled) {
  LabelledClip clip = waving();
  const auto markers = static_cast<std::ptrdiff_t>(clip.take.markers);
  clip.take.places_m.erase(clip.take.places_m.begin(), clip.take.places_m.begin() + 200 * markers);

  const auto run = run_labels(clip, {BodyKnown::Cold, {}, 1, nullptr});

  ASSERT_TRUE(run) << run.error().message;
  EXPECT_EQ(run->figures.frames, 200U);
  EXPECT_GT(run->since_first.frames, 50U);
  EXPECT_EQ(run->figures.wrong, 0U);
}

// The live pass finds nobody in the first quarter of a second or more.
TEST(RunLabels, LabelsOfflineWhatTheLivePassHadNotFoundYet) {
  LabelledClip clip = waving();
  const auto markers = static_cast<std::ptrdiff_t>(clip.take.markers);
  clip.take.places_m.erase(clip.take.places_m.begin(), clip.take.places_m.begin() + 200 * markers);
  for (const BodyKnown mode : {BodyKnown::Given, BodyKnown::Calibrated, BodyKnown::Cold}) {
    const auto run = run_labels(clip, {mode, *noise_named("cuts50"), 1, nullptr});

    ASSERT_TRUE(run) << run.error().message;
    EXPECT_EQ(run->offline.frames, run->figures.frames);
    EXPECT_EQ(run->offline.points, run->figures.points);
    ASSERT_LT(*run->figures.macro_f1, 0.985) << text_of(mode) << ": the comparison would mean nothing";
    EXPECT_GT(*run->offline.macro_f1, 0.99) << text_of(mode);
    EXPECT_EQ(run->offline.wrong, 0U) << text_of(mode);
  }
}

TEST(RunLabels, CountsEachPointWithoutALabelOnce) {
  const auto run = run_labels(waving(), {BodyKnown::Given, *noise_named("uniform30"), 2, nullptr});

  ASSERT_TRUE(run) << run.error().message;
  std::uint64_t withheld = 0, of_markers = 0;
  for (const std::uint64_t count : run->withheld) withheld += count;
  for (const auto& marker : run->withheld_of) {
    for (const std::uint64_t count : marker) of_markers += count;
  }
  EXPECT_GT(withheld, 0U);
  EXPECT_EQ(withheld, of_markers);
  EXPECT_GT(run->withheld[static_cast<std::size_t>(Withheld::NotTracking)], 0U);  // until it is identified
}

TEST(RunLabels, AClipWithoutMarkersIsRefused) {
  LabelledClip clip = waving();
  for (Eigen::Vector3d& at_m : clip.take.places_m) at_m.setConstant(std::nan(""));

  const auto run = run_labels(clip, {});

  ASSERT_FALSE(run);
  EXPECT_NE(run.error().message.find("waving"), std::string::npos);
}

TEST(PointPipeline, ACutEndsTheTrackOfItsPoint) {
  settings::DaemonSettings settings;
  settings.rig = scene::ring_rig({});
  PointPipeline pipeline(settings);
  NoisyFrame frame;
  frame.points = {{{0.0, 0.0, 1.0}, 0}, {{0.5, 0.0, 1.0}, 1}};
  for (int i = 0; i < 10; ++i) pipeline.step(from_ns(1'000'000'000) + i * std::chrono::milliseconds(10), frame);
  const TrackedMarkers before = pipeline.tracked();

  frame.cut_m = {{0.5, 0.0, 1.0}};
  pipeline.step(from_ns(1'100'000'000), frame);

  ASSERT_EQ(pipeline.tracked().size(), 2U);
  for (const TrackedMarker& track : pipeline.tracked()) {
    const bool is_cut = track.position.v.x() > 0.25;
    const bool was_there = std::ranges::find(before, track.id, &TrackedMarker::id) != before.end();
    EXPECT_NE(is_cut, was_there);
  }
}

TEST(Withheld, HasATextForEachReason) {
  for (std::size_t r = 0; r < kWithheldReasons; ++r) EXPECT_FALSE(text_of(static_cast<Withheld>(r)).empty());
}

TEST(BodyKnown, IsNamedAsItIsPrinted) {
  for (const BodyKnown mode : {BodyKnown::Given, BodyKnown::Static, BodyKnown::Calibrated, BodyKnown::Cold}) {
    EXPECT_EQ(mode_named(text_of(mode)), mode);
  }
  EXPECT_FALSE(mode_named("warm"));
}

TEST(LabelledClip, HasTheMarkersAndTheOtherPointsOfATrcFile) {
  const support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "walk.trc";
  std::ofstream(file) << "PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
                         "100.00\t100.00\t2\t6\tmm\nFrame#\tTime\tLASI\t\t\tRASI\t\t\tLPSI\t\t\tRPSI\t\t\tFoo\t\t\t"
                         "LASI\t\t\t\n\tX1\tY1\tZ1\n"
                         "1\t0.00\t1\t2\t900\t2\t-2\t900\t-1\t1\t1000\t-1\t-1\t1000\t7\t8\t1900\t1\t2\t901\n"
                         "2\t0.01\t1\t2\t900\t\t\t\t-1\t1\t1000\t-1\t-1\t1000\t7\t8\t1900\t1\t2\t901\n";

  const auto clip = load_labelled_clip(file, std::nullopt);

  ASSERT_TRUE(clip) << clip.error().message;
  EXPECT_EQ(clip->name, "walk");
  EXPECT_EQ(clip->rate_hz, 100.0);
  ASSERT_EQ(clip->marker_set.markers.size(), 4U);
  EXPECT_EQ(clip->other.size(), 2U);  // Foo, and the second LASI
  EXPECT_EQ(clip->frames(), 2U);
  EXPECT_LT((clip->take.frame(0)[0] - Eigen::Vector3d(0.001, 0.002, 0.9)).norm(), 1e-9);
  EXPECT_FALSE(clip->take.frame(1)[1].allFinite());
}

TEST(LabelledClip, RefusesAFileThatIsNoRecording) {
  const support::TemporaryFolder folder;
  std::ofstream(folder.path() / "bad.trc") << "nothing";

  EXPECT_FALSE(load_labelled_clip(folder.path() / "bad.trc", std::nullopt));
  EXPECT_FALSE(load_labelled_clip(folder.path() / "none.c3d", std::nullopt));
  EXPECT_FALSE(simworld::parse_trc("nothing"));
}

TEST(ParseTrc, RefusesShortLinesBelowAWideHeader) {
  std::string text = "PathFileType\n\n100\t100\t9\t999\tmm\nFrame#\tTime";
  for (int i = 0; i < 999; ++i) text += "\tM\t\t";
  text += "\n\n\n";
  for (int i = 0; i < 9; ++i) text += "1\t0\t5\n";

  const auto clip = simworld::parse_trc(text);

  ASSERT_FALSE(clip);
  EXPECT_NE(clip.error().message.find("far fewer cells"), std::string::npos) << clip.error().message;
}

TEST(RestPositions, StandOnTheFloorWithTheHandsToBothSides) {
  const auto set = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");

  const auto places_m = rest_positions_m(*set);

  double lowest_m = 1e9, left_m = 0.0;
  for (std::size_t m = 0; m < places_m.size(); ++m) {
    lowest_m = std::min(lowest_m, places_m[m].z());
    if (set->markers[m].name == "LeftHand") left_m = places_m[m].y();
  }
  EXPECT_NEAR(lowest_m, 0.03, 1e-9);
  EXPECT_GT(left_m, 0.6);
}

}  // namespace label_run_test
}  // namespace mocap::benchmark
