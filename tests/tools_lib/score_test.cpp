#include "lib/scoring/score.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace mocap::scoring {
namespace score_test {

constexpr Duration kPeriod = std::chrono::milliseconds(10);

Timestamp at_frame(int i) { return from_ns(1'000'000'000) + i * kPeriod; }

// Three markers, 300 mm apart, that move along x with 1 m/s; one bone that turns about z with 1 rad/s.
EvalFrame moving(Timestamp at) {
  const double t = to_s(at - at_frame(0));
  EvalFrame frame;
  frame.exposed_at = at;
  frame.number = static_cast<std::uint64_t>((at - at_frame(0)) / kPeriod);
  frame.views = 4;
  frame.expected_views = 4;
  for (std::uint32_t i = 0; i < 3; ++i) {
    frame.markers.push_back({0, i, LabelState::Measured, {t, 0.3 * i, 1.0}});
  }
  frame.bones.push_back(
      {0, 0, BoneState::Measured, {t, 0.0, 1.0}, Eigen::Quaterniond(Eigen::AngleAxisd(t, Eigen::Vector3d::UnitZ()))});
  return frame;
}

std::vector<EvalFrame> take(int frames, Duration shift = {}) {
  std::vector<EvalFrame> all;
  for (int i = 0; i < frames; ++i) all.push_back(moving(at_frame(i) + shift));
  return all;
}

Truth truth_of(int frames) {
  auto truth = Truth::of(take(frames));
  EXPECT_TRUE(truth);
  return std::move(*truth);
}

TEST(Score, IsPerfectForTheTruth) {
  const Score s = score(truth_of(300), take(300), {});

  EXPECT_EQ(s.stream_frames, 300U);
  EXPECT_EQ(s.frames, 200U);  // the first second is not scored
  EXPECT_EQ(s.labels_expected, 600U);
  EXPECT_EQ(s.labels_right, 600U);
  EXPECT_EQ(s.label_errors + s.missing + s.ghosts + s.gaps + s.duplicates, 0U);
  EXPECT_NEAR(*s.marker_rms_mm, 0.0, 1e-9);
  EXPECT_NEAR(*s.joint_rms_mm, 0.0, 1e-9);
  EXPECT_EQ(*s.complete_share, 1.0);
  EXPECT_EQ(*s.time_to_first_label_s, 0.0);
}

TEST(Score, InterpolatesTheTruthBetweenItsInstants) {
  const Score s = score(truth_of(300), take(299, std::chrono::milliseconds(3)), {});

  EXPECT_NEAR(*s.marker_rms_mm, 0.0, 1e-6);  // without interpolation: 3 mm
  EXPECT_NEAR(*s.rotation_rms_deg, 0.0, 1e-5);
}

TEST(Score, MeasuresTheErrorsOfMarkersAndJoints) {
  std::vector<EvalFrame> stream = take(300);
  for (EvalFrame& frame : stream) {
    frame.markers[0].position_m.z() += 0.003;
    frame.bones[0].position_m.y() += 0.004;
    frame.bones[0].rotation = frame.bones[0].rotation * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  }

  const Score s = score(truth_of(300), stream, {});

  EXPECT_EQ(s.label_errors, 0U);
  EXPECT_NEAR(*s.marker_rms_mm, 3.0 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(*s.marker_max_mm, 3.0, 1e-6);
  EXPECT_NEAR(*s.joint_rms_mm, 4.0, 1e-6);
  EXPECT_NEAR(*s.rotation_rms_deg, 0.1 * 180.0 / 3.14159265358979, 1e-6);
}

TEST(Score, CountsASwapAsTwoErrors) {
  std::vector<EvalFrame> stream = take(300);
  std::swap(stream[250].markers[0].position_m, stream[250].markers[1].position_m);

  const Score s = score(truth_of(300), stream, {});

  EXPECT_EQ(s.label_errors, 2U);
  EXPECT_EQ(s.labels_right, 598U);
  EXPECT_NEAR(*s.marker_rms_mm, 0.0, 1e-9);  // of the right labels
}

TEST(Score, CountsALabelThatIsCloserToAnotherMarker) {
  std::vector<EvalFrame> known = take(300);
  for (EvalFrame& frame : known)
    frame.markers[1].position_m = frame.markers[0].position_m + Eigen::Vector3d(0.0, 0.015, 0.0);
  std::vector<EvalFrame> stream = known;
  stream[250].markers[0].position_m.y() += 0.010;  // within 20 mm of its own, 5 mm from the other

  const Score s = score(*Truth::of(known), stream, {});

  EXPECT_EQ(s.label_errors, 1U);
}

TEST(Score, DistinguishesAWrongFilledMarkerFromAWrongLabel) {
  std::vector<EvalFrame> stream = take(300);
  for (const int i : {200, 201}) stream[static_cast<std::size_t>(i)].markers[2].state = LabelState::Filled;
  stream[200].markers[2].position_m.z() += 0.010;
  stream[201].markers[2].position_m.z() += 0.030;

  const Score s = score(truth_of(300), stream, {});

  EXPECT_EQ(s.label_errors, 0U);
  EXPECT_EQ(s.filled_off, 1U);
  EXPECT_EQ(s.labels_right, 599U);
  EXPECT_NEAR(*s.filled_rms_mm, std::sqrt((100.0 + 900.0) / 2.0), 1e-6);
}

TEST(Score, CountsMissingUnknownAndGhostMarkers) {
  std::vector<EvalFrame> stream = take(300);
  stream[210].markers.pop_back();
  stream[211].markers.push_back({0, 77, LabelState::Measured, Eigen::Vector3d::Zero()});
  stream[212].unlabelled_m = {stream[212].markers[0].position_m + Eigen::Vector3d(0.0, 0.0, 0.049),
                              stream[212].markers[0].position_m + Eigen::Vector3d(0.0, 0.0, 0.051)};
  stream[213].views = 3;

  const Score s = score(truth_of(300), stream, {});

  EXPECT_EQ(s.missing, 1U);
  EXPECT_EQ(s.unknown_labels, 1U);
  EXPECT_EQ(s.unlabelled, 2U);
  EXPECT_EQ(s.ghosts, 1U);
  EXPECT_NEAR(*s.complete_share, 199.0 / 200.0, 1e-12);
  EXPECT_EQ(s.labels_right + s.label_errors + s.filled_off + s.missing, s.labels_expected);
}

TEST(Score, StartsASecondAfterTheFirstLabel) {
  std::vector<EvalFrame> stream = take(300);
  for (std::size_t i = 0; i < 50; ++i) stream[i].markers.clear();

  const Score s = score(truth_of(300), stream, {});

  EXPECT_NEAR(*s.time_to_first_label_s, 0.5, 1e-9);
  EXPECT_EQ(s.frames, 150U);
}

TEST(Score, CountsGapsRepetitionsAndFramesWithoutTruth) {
  std::vector<EvalFrame> stream = take(330);
  stream.erase(stream.begin() + 250, stream.begin() + 254);
  stream.insert(stream.begin() + 100, stream[99]);

  const Score s = score(truth_of(300), stream, {});

  EXPECT_EQ(s.gaps, 4U);
  EXPECT_EQ(s.duplicates, 1U);
  EXPECT_EQ(s.frames_without_truth, 30U);
}

TEST(Score, HasNoFiguresForAStreamWithoutLabels) {
  std::vector<EvalFrame> stream = take(300);
  for (EvalFrame& frame : stream) frame.markers.clear();

  const Score s = score(truth_of(300), stream, {});
  const auto json = nlohmann::json::parse(to_json(s));

  EXPECT_EQ(s.frames, 0U);
  EXPECT_TRUE(json.at("marker_rms_mm").is_null());
  EXPECT_TRUE(json.at("time_to_first_label_s").is_null());
  EXPECT_TRUE(json.at("complete_share").is_null());
  EXPECT_EQ(json.at("stream_frames"), 300);
  EXPECT_FALSE(to_text(s).empty());
}

TEST(Truth, IsEmptyWhereFramesAreMissing) {
  std::vector<EvalFrame> frames = take(100);
  frames.erase(frames.begin() + 50, frames.begin() + 60);
  const auto truth = Truth::of(frames);
  ASSERT_TRUE(truth);

  EXPECT_TRUE(truth->at(at_frame(30) + kPeriod / 3));
  EXPECT_FALSE(truth->at(at_frame(55)));
  EXPECT_TRUE(truth->at(at_frame(49) + kPeriod / 3));
  EXPECT_FALSE(truth->at(at_frame(100)));
}

TEST(Truth, RefusesInstantsThatDoNotIncrease) {
  std::vector<EvalFrame> frames = take(3);
  frames[2].exposed_at = frames[1].exposed_at;

  EXPECT_FALSE(Truth::of(frames));
  EXPECT_FALSE(Truth::of({}));
}

}  // namespace score_test
}  // namespace mocap::scoring
