#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"
#include "pose/bone_pose_proposer.h"
#include "pose/point_cloud.h"
#include "pose/pose_smoother.h"
#include "pose/pose_transition_smoother.h"
#include "pose/skeleton_tracker.h"
#include "support/archived.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace archive_test {

using test::archived;
using test::bone_named;
using test::marker_named;
using test::person;
using test::take_over;

constexpr double kStep_s = 1.0 / 60.0;

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set * kStep_s); }

// Walks along x while elbows and knees bend.
std::vector<Pose> walking(const MarkerSet& set, int step) {
  const double t_s = step * kStep_s;
  std::vector<Pose> locals;
  for (const Bone& bone : set.skeleton.bones) {
    Pose pose{bone.rest_offset_m, Eigen::Quaterniond::Identity()};
    const double bend_rad = 0.7 + 0.5 * std::sin(5.0 * t_s);
    Eigen::Vector3d rotation_rad = Eigen::Vector3d::Zero();
    if (bone.parent < 0) pose.position = {0.8 * t_s, 0.0, 1.0};
    if (bone.name == "LeftUpArm") rotation_rad = {-1.0, 0.0, 0.4 * std::sin(4.0 * t_s)};
    if (bone.name == "RightUpArm") rotation_rad = {1.0, 0.0, 0.4 * std::sin(4.0 * t_s)};
    if (bone.name == "LeftLowArm") rotation_rad = {0.0, 0.1 * bend_rad, -bend_rad};
    if (bone.name == "RightLowArm") rotation_rad = {0.0, 0.0, bend_rad};
    if (bone.name == "LeftUpLeg") rotation_rad = {0.0, 0.4 * std::sin(4.0 * t_s), 0.0};
    if (bone.name == "LeftLowLeg") rotation_rad = {0.0, bend_rad, 0.0};
    pose.rotation = kinematics::from_rotation_vector(rotation_rad);
    locals.push_back(pose);
  }
  return locals;
}

// The observations of a set, with noise. From set 40 to 70 of each 80 the left arm has no marker but the wrist's, which
// one camera sees, and the right leg none.
std::vector<kinematics::Observation> observe(const kinematics::PoseFit& truth, int step, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 0.001);
  const MarkerSet& set = truth.marker_set();
  const bool is_hidden = step % 80 >= 40 && step % 80 < 70;
  std::vector<kinematics::Observation> seen;
  for (kinematics::Observation one : test::see(truth)) {
    one.position += Eigen::Vector3d(normal(random), normal(random), normal(random));
    const auto m = static_cast<std::size_t>(one.marker);
    const std::string& bone = set.skeleton.bones[static_cast<std::size_t>(set.markers[m].bone)].name;
    const bool is_arm = bone.starts_with("Left") && (bone.ends_with("Arm") || bone.ends_with("Hand"));
    if (!is_hidden || (!is_arm && bone != "RightLowLeg" && bone != "RightFoot")) {
      seen.push_back(one);
    } else if (bone == "LeftHand" && kinematics::sits_in_joint(set.markers[m])) {
      const Eigen::Vector3d eye(6.0, 2.0, 2.0);
      seen.push_back(
          kinematics::observe_ray(one.marker, eye, (one.position - eye).normalized(), 2e-4, one.position, 0.003));
    }
  }
  return seen;
}

void advance(SkeletonTracker& body, const std::vector<kinematics::Observation>& seen, Timestamp when) {
  body.predict(when);
  (void)body.update(seen);
  (void)body.evaluate_hypothesis(seen);
  (void)body.update(seen);
  body.commit(seen);
  (void)body.compute_covariances(seen, when);
}

void refit(SkeletonTracker& body) {
  std::vector<Eigen::Vector3d> rest_offsets_m, marker_offsets_m;
  for (const Bone& bone : body.pose().marker_set().skeleton.bones) rest_offsets_m.push_back(1.01 * bone.rest_offset_m);
  for (const MarkerOnBone& marker : body.pose().marker_set().markers)
    marker_offsets_m.push_back(0.98 * marker.offset_m);
  body.refit(rest_offsets_m, marker_offsets_m);
}

void expect_equal_results(const SkeletonTracker& one, const SkeletonTracker& other, int step) {
  for (std::size_t b = 0; b < one.pose().locals().size(); ++b) {
    ASSERT_EQ(one.pose().world()[b].position, other.pose().world()[b].position) << step;
    ASSERT_EQ(one.pose().world()[b].rotation.coeffs(), other.pose().world()[b].rotation.coeffs()) << step;
  }
  for (std::size_t m = 0; m < one.pose().marker_set().markers.size(); ++m) {
    ASSERT_EQ(one.predicted_position(m), other.predicted_position(m)) << step;
    ASSERT_EQ(one.predicted_covariance(m), other.predicted_covariance(m)) << step;
  }
}

// A tracker that is replaced after each set by a new one with its belief gives the same results.
TEST(Archive, LetsASkeletonTrackerContinueAfterEachSet) {
  for (const char* name : {"baseline41", "openmocap18", "baseline51"}) {
    const MarkerSet set = person(name);
    kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
    SkeletonTracker body(set, {}), other(set, {});
    std::mt19937 random(5);
    for (int step = 0; step < 160; ++step) {
      truth.set_locals(walking(set, step));
      const std::vector<kinematics::Observation> seen = observe(truth, step, random);
      if (step == 20) refit(body), refit(other);
      for (SkeletonTracker* one : {&body, &other}) {
        if (step == 0) {
          ASSERT_TRUE(one->start(seen, at(step)));
        } else {
          advance(*one, seen, at(step));
        }
      }
      expect_equal_results(body, other, step);
      const std::vector<std::byte> belief = archived(body);
      ASSERT_EQ(belief, archived(other)) << name << ", set " << step;

      SkeletonTracker fresh(set, {});
      ASSERT_TRUE(take_over(belief, fresh));
      other = std::move(fresh);
    }
  }
}

TEST(Archive, LetsSmoothersContinue) {
  const MarkerSet set = person("baseline41");
  const std::size_t bones = set.skeleton.bones.size();
  const SmoothSettings settings{.min_cutoff_hz = 2.0};
  PoseSmoother smoother(settings, bones), other_smoother(settings, bones);
  PoseTransitionSmoother easing(bones), other_easing(bones);
  for (int step = 0; step < 60; ++step) {
    const std::vector<Pose> poses = walking(set, step), predicted = walking(set, step - step % 7);
    const std::vector<std::uint8_t> changed(bones, step % 7 == 6 ? 1 : 0);
    (void)smoother.step(easing.step(poses, predicted, changed, kStep_s), kStep_s);
    if (step > 30) (void)other_smoother.step(other_easing.step(poses, predicted, changed, kStep_s), kStep_s);
    if (step < 30) continue;
    if (step == 30) {
      ASSERT_TRUE(take_over(archived(smoother), other_smoother));
      ASSERT_TRUE(take_over(archived(easing), other_easing));
    }
    EXPECT_EQ(smoother.delay_s(), other_smoother.delay_s());
    EXPECT_EQ(archived(smoother), archived(other_smoother)) << step;
    EXPECT_EQ(archived(easing), archived(other_easing)) << step;
  }
}

TEST(Archive, HasThePointsAndTheDistancesOfACloud) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(normal(random), normal(random), normal(random));
  PointCloud cloud, other;
  cloud.assign(points);
  other.assign(std::span(points).first(7));

  ASSERT_TRUE(take_over(archived(cloud), other));

  ASSERT_EQ(cloud.size(), other.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(cloud[i], other[i]);
    for (std::size_t j = 0; j < cloud.size(); ++j) EXPECT_EQ(cloud.distance(i, j), other.distance(i, j));
  }
}

TEST(Archive, WithTooFewBytesIsRefused) {
  const MarkerSet set = person("baseline41");
  SkeletonTracker body(set, {}), other(set, {});
  std::vector<std::byte> bytes = archived(body);
  bytes.pop_back();

  EXPECT_FALSE(take_over(bytes, other));
}

}  // namespace archive_test
}  // namespace mocap::pose
