#include "identify/distance_constraints.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "kinematics/kinematic_tree.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace distance_constraints_test {

using Eigen::Vector3d;

constexpr double kRounding_m = 1e-9;

// Positions of all markers with a random rotation of each joint; the joints ignore their ranges.
std::vector<Vector3d> markers_in_any_pose(const MarkerSet& set, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<Eigen::Quaterniond> rotations;
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    rotations.push_back(
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized());
  }
  std::vector<Pose> world(rotations.size());
  kinematics::compute_forward_kinematics(set.skeleton, {0.3, -0.2, 1.0}, rotations, world);
  std::vector<Vector3d> markers;
  for (const MarkerOnBone& marker : set.markers) {
    markers.push_back(kinematics::marker_position(marker, world[static_cast<std::size_t>(marker.bone)]).v);
  }
  return markers;
}

const InterMarkerDistance* constraint(const DistanceConstraints& constraints, std::size_t a, std::size_t b) {
  const auto of_a = constraints.of(a);
  const auto found = std::ranges::find(of_a, static_cast<int>(b), &InterMarkerDistance::other);
  return found == of_a.end() ? nullptr : &*found;
}

// Root, upper and lower bone in a row, with one marker on each; the last marker sits in the joint of the lower bone.
MarkerSet chain() {
  MarkerSet set;
  const auto add_bone = [&](int parent, const Vector3d& rest_offset_m) {
    Bone& bone = set.skeleton.bones.emplace_back();
    bone.parent = parent;
    bone.rest_offset_m = rest_offset_m;
  };
  add_bone(-1, Vector3d::Zero());
  add_bone(0, {0.0, 0.1, 0.0});
  add_bone(1, {0.0, 0.3, 0.0});
  set.markers = {{.name = "on root", .bone = 0, .offset_m = {0.0, -0.1, 0.0}},
                 {.name = "on upper", .bone = 1, .offset_m = {0.0, 0.05, 0.0}},
                 {.name = "on lower", .bone = 2, .offset_m = {0.0, 0.2, 0.0}},
                 {.name = "in joint", .bone = 2}};
  return set;
}

TEST(DistanceConstraints, HoldInAnyPose) {
  std::mt19937 random(5);
  for (const char* name : {"openmocap18", "baseline41"}) {
    const MarkerSet set = test::person(name);
    const DistanceConstraints constraints(set);
    for (int trial = 0; trial < 200; ++trial) {
      const std::vector<Vector3d> markers = markers_in_any_pose(set, random);

      for (std::size_t m = 0; m < markers.size(); ++m) {
        for (const InterMarkerDistance& distance : constraints.of(m)) {
          const double truth = (markers[m] - markers[static_cast<std::size_t>(distance.other)]).norm();
          ASSERT_GE(truth, distance.min_m - kRounding_m) << set.markers[m].name;
          ASSERT_LE(truth, distance.max_m + kRounding_m) << set.markers[m].name;
        }
      }
    }
  }
}

TEST(DistanceConstraints, AreRigidExactlyIfThePoseCannotChangeTheDistance) {
  std::mt19937 random(6);
  for (const char* name : {"openmocap18", "baseline41"}) {
    const MarkerSet set = test::person(name);
    const DistanceConstraints constraints(set);
    const std::vector<Vector3d> first = markers_in_any_pose(set, random);
    const std::vector<Vector3d> second = markers_in_any_pose(set, random);

    int rigid = 0;
    for (std::size_t a = 0; a < first.size(); ++a) {
      for (std::size_t b = 0; b < first.size(); ++b) {
        const bool is_constant = std::abs((first[a] - first[b]).norm() - (second[a] - second[b]).norm()) < kRounding_m;
        const InterMarkerDistance* const one = constraint(constraints, a, b);
        EXPECT_EQ(one != nullptr && one->rigid, a != b && is_constant) << set.markers[a].name << set.markers[b].name;
        rigid += one != nullptr && one->rigid ? 1 : 0;
      }
    }
    EXPECT_GT(rigid, 0);
  }
}

TEST(DistanceConstraints, BoundTheDistanceAcrossAJointByTheTriangleInequality) {
  const DistanceConstraints constraints(chain());

  // 5 cm before a joint at 30 cm: 25 cm from the joint; the lower marker is 20 cm behind it.
  const InterMarkerDistance* const across = constraint(constraints, 1, 2);
  ASSERT_NE(across, nullptr);
  EXPECT_FALSE(across->rigid);
  EXPECT_NEAR(across->min_m, 0.05, kRounding_m);
  EXPECT_NEAR(across->max_m, 0.45, kRounding_m);
  // A marker in the joint is rigid with both bones.
  ASSERT_NE(constraint(constraints, 1, 3), nullptr);
  EXPECT_TRUE(constraint(constraints, 1, 3)->rigid);
  EXPECT_NEAR(constraint(constraints, 1, 3)->max_m, 0.25, kRounding_m);
  EXPECT_TRUE(constraint(constraints, 3, 2)->rigid);
  // Two bones that share no joint.
  EXPECT_EQ(constraint(constraints, 0, 2), nullptr);
}

TEST(DistanceConstraints, AreTheSameInBothDirections) {
  const MarkerSet set = test::person("baseline41");
  const DistanceConstraints constraints(set);

  for (std::size_t a = 0; a < set.markers.size(); ++a) {
    for (const InterMarkerDistance& distance : constraints.of(a)) {
      const InterMarkerDistance* const back = constraint(constraints, static_cast<std::size_t>(distance.other), a);
      ASSERT_NE(back, nullptr);
      EXPECT_NEAR(back->min_m, distance.min_m, kRounding_m);
      EXPECT_NEAR(back->max_m, distance.max_m, kRounding_m);
    }
  }
}

TEST(DistanceConstraints, AreThoseOfTheFittedBodyAfterARefit) {
  const MarkerSet file = test::person("baseline41");
  MarkerSet fitted = file;
  for (Bone& bone : fitted.skeleton.bones) bone.rest_offset_m *= 1.1;
  for (MarkerOnBone& marker : fitted.markers) marker.offset_m *= 0.9;
  DistanceConstraints constraints(file);
  const DistanceConstraints expected(fitted);

  constraints.refit(fitted);

  for (std::size_t m = 0; m < file.markers.size(); ++m) {
    ASSERT_EQ(constraints.of(m).size(), expected.of(m).size());
    for (std::size_t i = 0; i < expected.of(m).size(); ++i) {
      EXPECT_EQ(constraints.of(m)[i].other, expected.of(m)[i].other);
      EXPECT_EQ(constraints.of(m)[i].min_m, expected.of(m)[i].min_m);
      EXPECT_EQ(constraints.of(m)[i].max_m, expected.of(m)[i].max_m);
    }
  }
}

}  // namespace distance_constraints_test
}  // namespace mocap::identify
