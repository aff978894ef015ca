// Compares the quality on three takes of tests/takes with stored figures, to detect a change of quality early. If the
// quality improves, store the new figures and give the reason in the commit.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "eval/blob_pipeline.h"
#include "lib/scoring/score.h"
#include "scene/procedural_actor.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "take/recordings/blob_recording.h"

namespace mocap::eval {
namespace recorded_takes_test {

/// Stored figures of one take.
struct FrozenTake {
  const char* name;
  const char* motion;    ///< motion of the simulated actor, from which the truth is computed
  double first_label_s;  ///< since the first image
  std::uint64_t labels;  ///< expected labels, from 0.5 s after the first label
  std::uint64_t right_labels;
  double marker_rms_mm, joint_rms_mm;
};

void PrintTo(const FrozenTake& take, std::ostream* to) { *to << take.name; }

class RecordedTakes : public testing::TestWithParam<FrozenTake> {};

/// The truth at each instant of a stream. The motion starts at the first instant.
scoring::Truth truth_of(const scene::Actor& actor, const std::vector<scoring::EvalFrame>& stream) {
  std::vector<scoring::EvalFrame> frames;
  scene::ActorState state;
  for (const scoring::EvalFrame& one : stream) {
    actor.at(to_s(one.exposed_at - stream.front().exposed_at), state);
    scoring::EvalFrame& frame = frames.emplace_back();
    frame.exposed_at = one.exposed_at;
    for (std::uint32_t m = 0; m < state.markers.size(); ++m) {
      frame.markers.push_back({0, m, LabelState::Measured, state.markers[m].position.v, 0});
    }
    for (std::uint32_t b = 0; b < state.world_from_bone.size(); ++b) {
      const Pose& pose = state.world_from_bone[b];
      frame.bones.push_back({0, b, BoneState::Measured, pose.position, pose.rotation});
    }
  }
  return *scoring::Truth::of(std::move(frames));
}

std::vector<scoring::EvalFrame> track(const take::BlobRecording& take, const settings::DaemonSettings& settings) {
  BlobPipeline pipeline(settings);
  std::vector<scoring::EvalFrame> stream;
  for (std::size_t i = 0; i < take.pictures.front().size(); ++i) {
    std::vector<BlobFrame> frames(take.cameras.size());
    for (std::size_t c = 0; c < frames.size(); ++c) {
      const take::RecordedPicture& picture = take.pictures[c][i];
      frames[c].camera = CameraId{static_cast<std::uint32_t>(c)};
      frames[c].number = picture.number;
      frames[c].exposed_at = picture.exposed_at;
      for (const Blob& blob : picture.blobs) frames[c].blobs.push_back(blob);
    }
    stream.push_back(scoring::frame_of(pipeline.step(frames)));
  }
  return stream;
}

TEST_P(RecordedTakes, KeepTheirQuality) {
  const FrozenTake& frozen = GetParam();
  const std::string base = support::source_folder() + "/tests/takes/" + frozen.name;
  const auto take = take::read_blob_recording(base + ".blobs");
  ASSERT_TRUE(take) << take.error().message;
  const auto set = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");
  ASSERT_TRUE(set) << set.error().message;
  const auto rig = settings::load_rig(base + ".rig.toml");
  ASSERT_TRUE(rig) << settings::to_text(rig.error());
  settings::DaemonSettings settings;
  settings.rig = *rig;
  settings.subject_models.push_back({"actor", *set});
  const auto actor = scene::make_procedural_actor(*set, *scene::parse_program(frozen.motion));

  const std::vector<scoring::EvalFrame> stream = track(*take, settings);
  const scoring::Score score = scoring::score(truth_of(*actor, stream), stream, {.after_s = 0.5});

  RecordProperty("score", to_json(score));
  EXPECT_EQ(score.label_errors, 0U) << to_text(score);
  EXPECT_EQ(score.labels_expected, frozen.labels) << to_text(score);
  // Tolerances of 0.5 % of the labels and 5 % of the errors: larger than the effect of another summation order, smaller
  // than a visible change.
  EXPECT_GE(static_cast<double>(score.labels_right), 0.995 * static_cast<double>(frozen.right_labels))
      << to_text(score);
  EXPECT_LE(score.time_to_first_label_s.value_or(1e9), frozen.first_label_s + 0.02) << to_text(score);
  EXPECT_LE(score.marker_rms_mm.value_or(1e9), 1.05 * frozen.marker_rms_mm) << to_text(score);
  EXPECT_LE(score.joint_rms_mm.value_or(1e9), 1.05 * frozen.joint_rms_mm) << to_text(score);
}

INSTANTIATE_TEST_SUITE_P(Frozen, RecordedTakes,
                         testing::Values(FrozenTake{"walk", "tpose:1,walk", 0.4, 2268, 2268, 0.1013, 0.0927},
                                         FrozenTake{"jump_clutter", "tpose:1,jump", 0.4, 2268, 2268, 0.0869, 0.0938},
                                         FrozenTake{"crouch_saturated", "tpose:1,crouch", 0.4, 2268, 2268, 0.1089,
                                                    0.1174}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace recorded_takes_test
}  // namespace mocap::eval
