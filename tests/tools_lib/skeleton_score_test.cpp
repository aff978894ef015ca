#include "lib/scoring/skeleton_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/random.h"

namespace mocap::scoring {
namespace skeleton_score_test {

EvalFrame bones_at(int set) {
  EvalFrame frame;
  frame.exposed_at = from_ns(0) + set * std::chrono::milliseconds(10);
  for (std::uint32_t b = 0; b < 3; ++b) {
    frame.bones.push_back({0,
                           b,
                           b == 2 ? BoneState::Filled : BoneState::Measured,
                           {0.01 * set, 0.3 * b, 1.0},
                           Eigen::Quaterniond::Identity()});
  }
  return frame;
}

TEST(SkeletonScorer, MeasuresJointsRotationsAndHiddenJoints) {
  SkeletonScorer scorer(true);
  const double turned_rad = 2.0 * std::numbers::pi / 180.0;
  for (int set = 0; set < 50; ++set) {
    EvalFrame said = bones_at(set);
    said.bones[0].position_m.z() += 0.003;
    said.bones[2].position_m.y() += 0.006;
    said.bones[1].rotation = Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitX());
    scorer.add(bones_at(set), said);
  }

  const SkeletonCounts& counts = scorer.counts().at(0);

  EXPECT_EQ(counts.sets, 50U);
  EXPECT_EQ(counts.joints, 150U);
  EXPECT_NEAR(*counts.joint_rms_mm(), std::sqrt((9.0 + 36.0) / 3.0), 1e-9);
  EXPECT_NEAR(1000.0 * counts.max_m, 6.0, 1e-9);
  EXPECT_NEAR(*counts.rotation_rms_deg(), 2.0 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(*counts.hidden_joint_rms_mm(), 6.0, 1e-9);
  EXPECT_NEAR(*counts.jitter_mm(), 0.0, 1e-9);  // a constant error is not jitter
  EXPECT_EQ(scorer.errors().at(0).size(), 50U);
}

TEST(SkeletonScorer, SeparatesBonesWhoseRotationIsNotObservable) {
  SkeletonScorer scorer(false, {{true, false}});  // the third bone is not listed and counts as observable
  EvalFrame said = bones_at(0);
  const auto turned = [](double deg) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ()));
  };
  said.bones[0].rotation = turned(3.0);
  said.bones[1].rotation = turned(8.0);
  scorer.add(bones_at(0), said);

  const SkeletonCounts& counts = scorer.counts().at(0);

  EXPECT_NEAR(*counts.rotation_unobservable_deg(), 8.0, 1e-6);
  EXPECT_NEAR(*counts.rotation_observable_deg(), 3.0 / std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(*counts.rotation_rms_deg(), std::sqrt((9.0 + 64.0) / 3.0), 1e-6);  // over all bones
  EXPECT_NEAR(*scorer.bones().at(0).at(1).rotation_rms_deg(), 8.0, 1e-6);
}

TEST(SkeletonScorer, EstimatesTheStandardDeviationOfWhiteNoise) {
  SkeletonScorer scorer;
  scene::Random random(3);
  for (int set = 0; set < 3000; ++set) {
    EvalFrame said = bones_at(set);
    for (PosedBone& bone : said.bones) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) bone.position_m[axis] += 0.0005 * random.normal();
    }
    scorer.add(bones_at(set), said);
  }

  // 27000 second differences: standard deviation 1 %.
  EXPECT_NEAR(*scorer.counts().at(0).jitter_mm(), 0.5, 0.01);
}

TEST(SkeletonScorer, ComputesNoSecondDifferenceAcrossAGap) {
  SkeletonScorer scorer;
  for (int set = 0; set < 40; ++set) {
    EvalFrame said = bones_at(set);
    if (set == 20) said.bones.clear();
    if (set > 20) {
      for (PosedBone& bone : said.bones) bone.position_m.x() += 0.1;
    }
    scorer.add(bones_at(set), said);
  }

  EXPECT_NEAR(*scorer.counts().at(0).jitter_mm(), 0.0, 1e-9);
  EXPECT_EQ(scorer.counts().at(0).sets, 39U);
}

TEST(SkeletonScorer, HasNoFiguresWithoutPoses) {
  SkeletonScorer scorer;

  scorer.add(bones_at(0), EvalFrame{});

  EXPECT_TRUE(scorer.counts().empty());
  EXPECT_FALSE(SkeletonCounts{}.joint_rms_mm());
}

}  // namespace skeleton_score_test
}  // namespace mocap::scoring
