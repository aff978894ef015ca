#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <span>
#include <sstream>

#include "scene/clip_actor.h"
#include "support/places.h"

namespace mocap::scene {
namespace clip_test {

std::string read(const std::string& name) {
  std::ifstream stream(std::filesystem::path(support::shared_data_folder()) / name, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

C3d c3d_of(const std::string& bytes) { return *parse_c3d(std::as_bytes(std::span(bytes))); }

constexpr const char* kSmall =
    "HIERARCHY\nROOT root\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    " JOINT arm\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   OFFSET 0 5 0\n  "
    "}\n }\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.5\n1 2 3 0 0 0 0 0 0\n3 2 3 90 0 0 0 0 40\n";

TEST(Bvh, InterpolatesTwoFramesLinearly) {
  const auto bvh = parse_bvh(kSmall);
  ASSERT_TRUE(bvh) << bvh.error().message;
  BvhPosture posture;

  posture_of(*bvh, 0.125, posture);

  EXPECT_LT((posture.root - Eigen::Vector3d(1.5, 2, 3)).norm(), 1e-12);
  const Eigen::AngleAxisd quarter_z(std::numbers::pi / 8.0, Eigen::Vector3d::UnitZ()),
      quarter_y(std::numbers::pi / 18.0, Eigen::Vector3d::UnitY());
  EXPECT_LT(posture.rotations[0].angularDistance(Eigen::Quaterniond(quarter_z)), 1e-9);
  EXPECT_LT(posture.rotations[1].angularDistance(Eigen::Quaterniond(quarter_y)), 1e-9);
}

TEST(Bvh, RotatesInTheOrderOfTheChannels) {
  std::string text = kSmall;
  text.replace(text.find("1 2 3 0 0 0 0 0 0"), 17, "1 2 3 0 0 0 90 90 0");
  const auto bvh = parse_bvh(text);
  ASSERT_TRUE(bvh);
  BvhPosture posture;

  posture_of(*bvh, 0.0, posture);

  // The rotation about x comes first and moves y to z; the rotation about z does not move z.
  EXPECT_LT((posture.rotations[1] * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(Bvh, RefusesEveryTruncationWithTheLine) {
  const std::string text = kSmall;
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    const auto bvh = parse_bvh(text.substr(0, length));
    if (length < text.find(" 40")) {
      ASSERT_FALSE(bvh) << length;
    }
    if (!bvh) {
      EXPECT_EQ(bvh.error().message.substr(0, 8), "BVH line");
    }
  }
}

TEST(Bvh, ReadsRealFilesAndPutsTheMotionOnTheFloor) {
  for (const char* name : {"bvh/cmu_131_01.bvh", "bvh/cmu_18_01_walk_shakehands_A.bvh", "bvh/dm_walk.bvh"}) {
    const std::string text = read(name);
    if (text.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();
    auto bvh = parse_bvh(text);
    ASSERT_TRUE(bvh) << name << bvh.error().message;
    const double length_s = bvh->frame_time_s * static_cast<double>(bvh->frames);
    auto actor = make_bvh_actor(std::move(*bvh), std::nullopt, {});
    ASSERT_TRUE(actor) << name;
    ActorState state;
    double low = 1e9, high = -1e9;
    for (double t_s = 0.0; t_s < length_s + 3.0; t_s += 0.05) {
      (*actor)->at(t_s, state);
      for (const ActorMarker& marker : state.markers) {
        low = std::min(low, marker.position.v.z());
        high = std::max(high, marker.position.v.z());
      }
    }
    EXPECT_NEAR(low, 0.05, 0.03) << name;  // the sole height; frames may be between the sampled instants
    EXPECT_NEAR(high, 1.65, 0.25) << name;
  }
}

TEST(KnownJoint, FindsNamesOfOtherPrograms) {
  EXPECT_EQ(known_joint("mixamorig:LeftForeArm"), "LeftLowArm");
  EXPECT_EQ(known_joint("right_hip"), "RightUpLeg");
  EXPECT_EQ(known_joint("lfemur"), "LeftUpLeg");
  EXPECT_EQ(known_joint("LeftHip"), "LeftUpLeg");
  EXPECT_EQ(known_joint("hip"), "Hips");
  EXPECT_EQ(known_joint("LHipJoint"), "");
  EXPECT_EQ(known_joint("rclavicle"), "RightCollar");
}

// Another program read the expected values from the same file.
TEST(C3d, ReadsFloatSamples) {
  const std::string bytes = read("c3d/btk_pig_walk_static_100.c3d");
  if (bytes.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();

  const C3d c3d = c3d_of(bytes);

  EXPECT_EQ(c3d.rate_hz, 100.0);
  EXPECT_EQ(c3d.labels.size(), 137U);
  EXPECT_EQ(c3d.frames, 94U);
  EXPECT_EQ(c3d.labels[0], "LFHD");
  EXPECT_LT((c3d.sample(0, 0).position_m - Eigen::Vector3d(-0.01736548614, 0.11624053192, 1.45884655762)).norm(), 1e-9);
  EXPECT_TRUE(c3d.sample(0, 0).there);
}

TEST(C3d, DistinguishesMarkersGhostsAndModelOutputs) {
  const std::string ghosts = read("c3d/pycgm_movement_42unlabelled_120.c3d"),
                    model = read("c3d/btk_pig_walk_fullbody_100.c3d");
  if (ghosts.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();

  const auto of_ghosts = kinds_of(c3d_of(ghosts).labels), of_model = kinds_of(c3d_of(model).labels);

  EXPECT_EQ(std::ranges::count(of_ghosts, C3dPointKind::Ghost), 42);
  EXPECT_EQ(std::ranges::count(of_ghosts, C3dPointKind::Marker), 39);
  EXPECT_EQ(std::ranges::count(of_model, C3dPointKind::Marker), 35);
}

// The oracle is a smoothed export of the same trial by another program, in TRC format.
TEST(C3d, ReadsDecIntegersWithin5mmOfTheSmoothedExport) {
  const std::string bytes = read("c3d/btk_gait_cammask_100.c3d"), trc = read("trc/btk_Gait.trc");
  if (bytes.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();

  const C3d c3d = c3d_of(bytes);

  const auto shoulder = static_cast<std::size_t>(std::ranges::find(c3d.labels, "RSHO") - c3d.labels.begin());
  ASSERT_LT(shoulder, c3d.labels.size());
  std::istringstream lines(trc);
  std::string line;
  int compared = 0, near = 0;
  for (int i = 0; std::getline(lines, line); ++i) {
    std::array<std::string, 5> cells;  // frame, time, x, y, z; empty if the marker has no position
    std::istringstream fields(line);
    for (std::string& cell : cells) std::getline(fields, cell, '\t');
    if (i < 5 || cells[0].empty() || cells[2].empty()) continue;
    const std::size_t frame = std::stoul(cells[0]);
    if (frame > c3d.frames) continue;
    const Eigen::Vector3d cleaned_mm(std::stod(cells[2]), std::stod(cells[3]), std::stod(cells[4]));
    const C3dSample& sample = c3d.sample(frame - 1, shoulder);
    if (!sample.there) continue;
    ++compared;
    near += (sample.position_m - cleaned_mm / 1000.0).norm() < 0.005 ? 1 : 0;  // smoothing moved it by some mm
    EXPECT_NE(sample.cameras, 0) << frame;
  }
  EXPECT_GT(compared, 100);
  EXPECT_EQ(near, compared);
}

TEST(C3d, SurvivesTruncationsAndManyBrokenBytes) {
  const std::string whole = read("c3d/btk_pig_walk_static_100.c3d");
  if (whole.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();
  for (std::size_t length = 0; length < whole.size(); length += 997) {
    const std::string bytes = whole.substr(0, length);
    (void)parse_c3d(std::as_bytes(std::span(bytes)));
  }
  std::string bytes = whole;
  for (std::size_t i = 0; i < 20000; i += 7) bytes[i] = static_cast<char>(i * 31);
  bytes[0] = 2;
  bytes[1] = 0x50;
  (void)parse_c3d(std::as_bytes(std::span(bytes)));
}

TEST(C3dActor, HasNoPositionInGapsAndShowsGhosts) {
  const std::string gaps = read("c3d/btk_gait_cammask_100.c3d"),
                    unlabelled = read("c3d/pycgm_movement_42unlabelled_120.c3d");
  if (gaps.empty()) GTEST_SKIP() << "no " << support::shared_data_folder();
  auto with_gaps = make_c3d_actor(c3d_of(gaps)), with_ghosts = make_c3d_actor(c3d_of(unlabelled));
  ASSERT_TRUE(with_gaps && with_ghosts);
  ActorState state;

  (*with_gaps)->at(0.0, state);  // the shoulder has residual -1 in the first frame
  EXPECT_FALSE(state.markers[0].there);
  (*with_gaps)->at(3.0, state);
  EXPECT_GT(std::ranges::count(state.markers, true, &ActorMarker::there), 10);
  std::size_t ghosts = 0;
  for (int i = 0; i < 300; ++i) {
    (*with_ghosts)->at(i / 120.0, state);
    ghosts += state.ghosts.size();
  }
  EXPECT_EQ(state.markers.size(), 39U);
  EXPECT_GT(ghosts, 300U);
}

}  // namespace clip_test
}  // namespace mocap::scene
