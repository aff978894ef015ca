#include "pose/bone_pose_proposer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>
#include <vector>

#include "support/test_body.h"

namespace mocap::pose {
namespace bone_pose_proposer_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A bone with its joint at the origin and four markers without symmetry.
kinematics::BoneShape forearm() {
  kinematics::BoneShape shape;
  shape.points = {{0, {0.05, 0.10, 0.00}}, {1, {-0.04, 0.16, 0.02}}, {2, {0.00, 0.25, 0.06}}, {3, {0.03, 0.24, -0.03}}};
  return shape;
}

const Pose kTruth{{0.4, -0.3, 1.2}, Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(0.2, 0.9, -0.4).normalized()))};

// The markers of the bone at kTruth with 1 mm of noise in each axis (point m is marker m), then clutter around the
// bone.
std::vector<Vector3d> points_of(const kinematics::BoneShape& shape, int clutter, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 0.001);
  std::uniform_real_distribution<double> flat(-0.4, 0.4);
  std::vector<Vector3d> points;
  for (const auto& marker : shape.points)
    points.push_back(kTruth * marker.position_m + Vector3d(noise(random), noise(random), noise(random)));
  for (int i = 0; i < clutter; ++i)
    points.push_back(kTruth.position + Vector3d(flat(random), flat(random), flat(random)));
  return points;
}

const BoneProposal& best_of(std::span<const BoneProposal> proposals) {
  return *std::ranges::min_element(proposals, {}, &BoneProposal::cost);
}

std::vector<int> labels(const BoneProposal& proposal) { return {proposal.point_of.begin(), proposal.point_of.end()}; }

// 1 mm of noise in each axis of four markers that lie up to 6 cm beside the axis of the bone: 0.01 rad rms about it.
constexpr double kMaxError_rad = 0.05;
constexpr double kMaxError_m = 0.004;
// m: rounding
constexpr double kRounding_m = 1e-9;

JointAnchor anchor() { return {.anchor_m = kTruth.position, .sigma_m = 0.003}; }

TEST(BonePoseProposer, FindsAFreeBoneAmongClutter) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 10; ++trial) {
    BonePoseProposer proposer;
    proposer.set({.marker_sigma_m = 0.002});
    PointCloud cloud;
    cloud.assign(points_of(forearm(), 10, random));
    std::vector<BoneProposal> proposals;

    for (std::size_t first = 0; first < cloud.size(); ++first)
      proposer.propose_from_points(forearm(), cloud, first, 8, proposals);

    ASSERT_FALSE(proposals.empty());
    ASSERT_LE(proposals.size(), 8U);
    const BoneProposal& best = best_of(proposals);
    EXPECT_EQ(labels(best), (std::vector<int>{0, 1, 2, 3})) << trial;
    EXPECT_EQ(best.dof, Dof::Full);
    EXPECT_EQ(best.seen, 4);
    EXPECT_LT(best.cost, 0.0);
    EXPECT_LT(test::angle_between(best.world_from_bone.rotation, kTruth.rotation), kMaxError_rad);
    EXPECT_LT((best.world_from_bone * Vector3d(0.0, 0.2, 0.0) - kTruth * Vector3d(0.0, 0.2, 0.0)).norm(), kMaxError_m);
  }
}

TEST(BonePoseProposer, ProposesNoFreeBoneFromTwoPoints) {
  std::mt19937 random(9);
  BonePoseProposer proposer;
  PointCloud cloud;
  std::vector<Vector3d> points = points_of(forearm(), 0, random);
  points.resize(2);
  cloud.assign(points);
  std::vector<BoneProposal> proposals;

  for (std::size_t first = 0; first < cloud.size(); ++first)
    proposer.propose_from_points(forearm(), cloud, first, 8, proposals);

  EXPECT_TRUE(proposals.empty());
}

TEST(BonePoseProposer, FindsABoneAtAJointAmongClutter) {
  std::mt19937 random(10);
  const std::vector<int> nothing_known(4, -1);
  for (int trial = 0; trial < 10; ++trial) {
    BonePoseProposer proposer;
    proposer.set({.marker_sigma_m = 0.002});
    PointCloud cloud;
    cloud.assign(points_of(forearm(), 10, random));

    const auto proposals = proposer.propose_from_joint(forearm(), anchor(), cloud, {}, nothing_known);

    const BoneProposal& best = best_of(proposals);
    EXPECT_EQ(labels(best), (std::vector<int>{0, 1, 2, 3})) << trial;
    EXPECT_LT(test::angle_between(best.world_from_bone.rotation, kTruth.rotation), kMaxError_rad);
    EXPECT_LT((best.world_from_bone.position - kTruth.position).norm(), kMaxError_m);
  }
}

TEST(BonePoseProposer, SwingsABoneTowardsItsOnlyPoint) {
  BonePoseProposer proposer;
  kinematics::BoneShape shape;
  shape.points = {{0, {0.0, 0.25, 0.0}}};
  PointCloud cloud;
  cloud.assign(std::vector<Vector3d>{kTruth * Vector3d(0.0, 0.25, 0.0)});

  const auto proposals = proposer.propose_from_joint(shape, anchor(), cloud, {}, std::vector<int>{-1});

  ASSERT_EQ(proposals.size(), 2U);
  EXPECT_EQ(proposals[0].dof, Dof::Swing);
  EXPECT_LT((proposals[0].world_from_bone * Vector3d(0.0, 0.25, 0.0) - cloud[0]).norm(), kRounding_m);
  EXPECT_LT((proposals[0].world_from_bone.position - kTruth.position).norm(), kRounding_m);
  EXPECT_LT((proposals[0].axis - Vector3d::UnitY()).norm(), kRounding_m);
}

TEST(BonePoseProposer, EndsWithTheRestPoseWithoutDetections) {
  BonePoseProposer proposer;
  JointAnchor from = anchor();
  from.joint_m = {0.0, 0.1, 0.0};
  from.rest = kTruth.rotation;
  const PointCloud nothing;

  const auto proposals = proposer.propose_from_joint(forearm(), from, nothing, {}, std::vector<int>(4, -1));

  ASSERT_EQ(proposals.size(), 1U);
  EXPECT_EQ(proposals[0].dof, Dof::None);
  EXPECT_EQ(proposals[0].cost, 0.0);
  EXPECT_EQ(labels(proposals[0]), std::vector<int>(4, -1));
  EXPECT_LT((proposals[0].world_from_bone * from.joint_m - from.anchor_m).norm(), kRounding_m);
  EXPECT_LT(test::angle_between(proposals[0].world_from_bone.rotation, from.rest), kRounding_m);
}

TEST(BonePoseProposer, LeavesUsedPointsAndKnownMarkersAlone) {
  std::mt19937 random(11);
  BonePoseProposer proposer;
  proposer.set({.marker_sigma_m = 0.002});
  PointCloud cloud;
  cloud.assign(points_of(forearm(), 0, random));
  UsedPoints used;
  used.set(2);
  const std::vector<int> point_of_marker{-1, 7, -1, -1};  // a neighbour has given marker 1 a point

  const auto proposals = proposer.propose_from_joint(forearm(), anchor(), cloud, used, point_of_marker);

  EXPECT_EQ(labels(best_of(proposals)), (std::vector<int>{0, -2, -1, 3}));
  for (const BoneProposal& proposal : proposals) {
    EXPECT_EQ(std::ranges::count(proposal.point_of, 2), 0);
    EXPECT_LT(proposal.point_of[1], 0);
  }
}

}  // namespace bone_pose_proposer_test
}  // namespace mocap::pose
