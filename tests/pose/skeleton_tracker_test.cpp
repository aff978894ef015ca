#include "pose/skeleton_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace skeleton_tracker_test {

using test::bone_named;
using test::marker_named;
using test::person;
using test::see;
using test::without;

constexpr double kStep_s = 1.0 / 60.0;

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set * kStep_s); }

// Walks along x with both arms down at the sides, swinging forwards and backwards.
std::vector<Pose> swinging(const MarkerSet& set, int step) {
  const double t_s = step * kStep_s;
  const double swing = 0.5 * std::sin(4.0 * t_s);
  std::vector<Pose> locals;
  for (const Bone& bone : set.skeleton.bones) {
    Pose pose{bone.rest_offset_m, Eigen::Quaterniond::Identity()};
    if (bone.parent < 0) pose.position = {0.8 * t_s, 0.0, 1.0};
    if (bone.name == "LeftUpArm")
      pose.rotation =
          kinematics::from_rotation_vector({0.0, 0.0, swing}) * kinematics::from_rotation_vector({-1.1, 0.0, 0.0});
    if (bone.name == "RightUpArm")
      pose.rotation =
          kinematics::from_rotation_vector({0.0, 0.0, swing}) * kinematics::from_rotation_vector({1.1, 0.0, 0.0});
    if (bone.name == "LeftLowArm") pose.rotation = kinematics::from_rotation_vector({0.0, 0.0, -0.4});
    if (bone.name == "RightLowArm") pose.rotation = kinematics::from_rotation_vector({0.0, 0.0, 0.4});
    locals.push_back(pose);
  }
  return locals;
}

void follow(SkeletonTracker& body, const std::vector<kinematics::Observation>& seen, Timestamp when) {
  if (!body.is_tracking()) {
    ASSERT_TRUE(body.start(seen, when));
    return;
  }
  body.predict(when);
  (void)body.update(seen);
  body.commit(seen);
}

TEST(SkeletonTracker, PredictsAHiddenShoulderForHalfASecond) {
  const MarkerSet set = person("openmocap18");
  const std::size_t hidden = marker_named(set, "LeftUpArm");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  truth.set_locals(swinging(set, 0));
  ASSERT_TRUE(body.start(see(truth), at(0)));

  for (int step = 1; step < 60; ++step) {
    truth.set_locals(swinging(set, step));
    const std::vector<kinematics::Observation> seen = step < 30 ? see(truth) : without(see(truth), hidden);
    body.predict(at(step));
    (void)body.update(seen);
    body.commit(seen);

    // m; a larger error of a hidden joint is visible to an animator.
    EXPECT_LT((body.predicted_position(hidden) - truth.marker_at(hidden)).norm(), 0.03) << step;
  }
}

// A finger has no twist: its locked axis is known, and takes no part in the velocity.
TEST(SkeletonTracker, KeepsFingersWhoseJointsHaveALockedAxis) {
  const MarkerSet set = person("baseline51");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  for (int step = 0; step < 200; ++step) {
    std::vector<Pose> locals = swinging(set, step);
    locals[bone_named(set, "LeftIndex")].rotation =
        kinematics::from_rotation_vector({-0.6 + 0.5 * std::cos(3.0 * step * kStep_s), 0.0, 0.1});
    truth.set_locals(locals);
    follow(body, see(truth), at(step));
    for (const char* tip : {"LIndexTip", "LThumbTip", "RLittleTip"}) {
      const std::size_t marker = marker_named(set, tip);
      ASSERT_LT((body.predicted_position(marker) - truth.marker_at(marker)).norm(), 0.005) << tip << ' ' << step;
    }
  }
}

TEST(SkeletonTracker, PredictsAHiddenFingerFromTheHand) {
  const MarkerSet set = person("baseline51");
  const std::size_t hidden = marker_named(set, "LMiddleTip");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  for (int step = 0; step < 90; ++step) {
    truth.set_locals(swinging(set, step));
    follow(body, step < 30 ? see(truth) : without(see(truth), hidden), at(step));
    ASSERT_LT((body.predicted_position(hidden) - truth.marker_at(hidden)).norm(), 0.01) << step;
  }
}

TEST(SkeletonTracker, IncreasesTheCovarianceOfAHiddenMarkerWithTime) {
  const MarkerSet set = person("openmocap18");
  const std::size_t hand = marker_named(set, "LeftHand");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  const std::vector<kinematics::Observation> seen = without(see(truth), hand);
  SkeletonTracker body(set, {});
  ASSERT_TRUE(body.start(see(truth), at(0)));

  body.predict(at(1));
  (void)body.update(seen);
  ASSERT_TRUE(body.compute_covariances(seen, at(1)));
  const Eigen::Matrix3d soon = body.predicted_covariance(hand);
  ASSERT_TRUE(body.compute_covariances(seen, at(30)));
  const Eigen::Matrix3d late = body.predicted_covariance(hand);

  EXPECT_LT(soon.trace(), late.trace());
  // The forearm lies along y and does not stretch: small variance along y, large variance across, where the elbow
  // bends.
  EXPECT_LT(std::sqrt(late(1, 1)), 0.02);
  EXPECT_GT(std::sqrt(late(0, 0)), 0.10);
}

// A camera that is not synchronised adds sets without a marker, one shortly before each other set. The markers have 1
// mm noise, which is divided by the interval of two sets where a velocity is estimated.
TEST(SkeletonTracker, FollowsABodyBetweenSetsThatAreNearTheirSuccessors) {
  const MarkerSet set = person("openmocap18");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  truth.set_locals(swinging(set, 0));
  ASSERT_TRUE(body.start(see(truth), at(0)));
  std::mt19937 random(4);
  std::normal_distribution<double> noise_m(0.0, 0.001);

  for (int step = 1; step < 120; ++step) {
    follow(body, {}, at(step) - std::chrono::microseconds(650));
    truth.set_locals(swinging(set, step));
    std::vector<kinematics::Observation> seen = see(truth);
    for (kinematics::Observation& one : seen) {
      for (double& axis : one.position) axis += noise_m(random);
    }
    body.predict(at(step));
    const double error_m = (body.predicted_position(0) - truth.marker_at(0)).norm();
    (void)body.update(seen);
    body.commit(seen);

    if (step > 10) {
      EXPECT_LT(error_m, 0.03) << step;
    }
  }
}

TEST(SkeletonTracker, FindsAHandThatReappearsElsewhere) {
  const MarkerSet set = person("openmocap18");
  const std::size_t hand = marker_named(set, "LeftHand");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {.outlier_m = 0.02});
  ASSERT_TRUE(body.start(see(truth), at(0)));
  std::vector<Pose> bent(truth.locals().begin(), truth.locals().end());
  bent[static_cast<std::size_t>(set.markers[marker_named(set, "LeftLowArm")].bone)].rotation =
      kinematics::from_rotation_vector({0, 0, -0.9});
  truth.set_locals(bent);

  body.predict(at(1));
  (void)body.update(see(truth));

  EXPECT_LT((body.predicted_position(hand) - truth.marker_at(hand)).norm(), 0.005);
}

// A leg that swings forwards straightens and bends again.
TEST(SkeletonTracker, BendsAKneeForwardsIfOnlyFootAndHipAreObserved) {
  const MarkerSet set = person("baseline41");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  const auto bone = [&](const std::string& name) { return static_cast<std::size_t>(bone_named(set, name)); };
  const auto pose_at = [&](int step) {
    std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
    const double bent_rad = std::abs(0.9 - 0.12 * step);
    locals[bone("RightUpLeg")].rotation = kinematics::from_rotation_vector({0.0, -0.5 * bent_rad, 0.0});
    locals[bone("RightLowLeg")].rotation = kinematics::from_rotation_vector({0.0, bent_rad, 0.0});
    return locals;
  };
  SkeletonTracker body(set, {});
  truth.set_locals(pose_at(0));
  ASSERT_TRUE(body.start(see(truth), at(0)));

  for (int step = 1; step < 20; ++step) {
    truth.set_locals(pose_at(step));
    std::vector<kinematics::Observation> seen = see(truth);
    if (step > 3) {
      for (const char* hidden : {"RThigh", "RKneeOut", "RShin", "RAnkleOut"})
        seen = without(seen, marker_named(set, hidden));
    }
    body.predict(at(step));
    (void)body.update(seen);
    body.commit(seen);

    // A knee bent backwards would have an error of 0.5 m in the end. A straight leg hardly constrains the knee
    // sideways.
    const Eigen::Vector3d off =
        body.pose().world()[bone("RightLowLeg")].position - truth.world()[bone("RightLowLeg")].position;
    EXPECT_LT(off.norm(), step < 17 ? 0.15 : 0.06) << step;
  }
}

TEST(SkeletonTracker, ReinitialisesAForearmWithReversedTwist) {
  const MarkerSet set = person("baseline41");
  const std::size_t in = marker_named(set, "LWristIn");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  std::vector<kinematics::Observation> swapped = see(truth);
  std::swap(swapped[in].position, swapped[marker_named(set, "LWristOut")].position);
  ASSERT_TRUE(body.start(swapped, at(0)));

  body.predict(at(1));
  (void)body.update(see(truth));

  // m; the initial error is 80 mm, and the motion prior of one set leaves a small part of it.
  EXPECT_LT((body.predicted_position(in) - truth.marker_at(in)).norm(), 0.015);
}

TEST(SkeletonTracker, ReinitialisesALimbOnlyForAHypothesisThatMayBeBelowTheMaximumCost) {
  const MarkerSet set = person("baseline41");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  ASSERT_TRUE(body.start(see(truth), at(0)));
  body.predict(at(1));
  (void)body.update(see(truth));
  const auto with_arm_bent = [&](double rad) {
    std::vector<Pose> bent(truth.locals().begin(), truth.locals().end());
    bent[static_cast<std::size_t>(bone_named(set, "LeftLowArm"))].rotation =
        kinematics::from_rotation_vector({0, 0, -rad});
    truth.set_locals(bent);
    return see(truth);
  };

  int reinitialised = 0;
  for (int i = 1; i <= 20; ++i) {
    const std::vector<kinematics::Observation> seen = with_arm_bent(0.1 * i);
    const double cost = body.evaluate_hypothesis(seen).cost;
    const double at_once = body.evaluate_hypothesis(seen, -1e9).cost;
    reinitialised += at_once > cost ? 1 : 0;

    EXPECT_GE(at_once, cost) << i;
    EXPECT_EQ(body.evaluate_hypothesis(seen, cost).cost, cost) << i;  // a cost that may be below the maximum is exact
  }
  EXPECT_GT(reinitialised, 5);
}

// The only observed marker of an arm reappears elsewhere and rotates joints that no other marker observes.
TEST(SkeletonTracker, DerivesNoVelocityFromTheCorrectionByALoneMarker) {
  const MarkerSet set = person("baseline41");
  const std::size_t wrist = marker_named(set, "LWristIn");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  truth.set_locals(swinging(set, 0));
  ASSERT_TRUE(body.start(see(truth), at(0)));
  std::vector<kinematics::Observation> seen = see(truth);
  int i = 1;
  const auto step = [&] {
    body.predict(at(i++));
    (void)body.update(seen);
    body.commit(seen);
  };
  for (int n = 0; n < 10; ++n) step();
  for (const char* hidden :
       {"LShoulderTop", "LShoulderBack", "LUArmHigh", "LElbowOut", "LWristOut", "LHandIn", "LHandOut"})
    seen = without(seen, marker_named(set, hidden));
  for (int n = 0; n < 5; ++n) step();

  for (kinematics::Observation& one : seen) {
    if (one.marker == static_cast<int>(wrist)) one.position += Eigen::Vector3d(0.25, 0.05, 0.1);
  }
  const auto off_m = [&] {
    const auto own = std::ranges::find(seen, static_cast<int>(wrist), &kinematics::Observation::marker);
    return (body.predicted_position(wrist) - own->position).norm();
  };
  for (int n = 0; n < 20; ++n) {
    step();
    EXPECT_LT(off_m(), 0.03) << n;
    body.predict(at(i));
    EXPECT_LT(off_m(), 0.02) << n;
  }
}

// A hidden forearm stays at the pose of the last fit, wherever the search for a hypothesis begins.
TEST(SkeletonTracker, KeepsTheMotionPriorAroundTheLastFitForAnyStart) {
  const MarkerSet set = person("baseline41");
  const auto elbow = static_cast<std::size_t>(bone_named(set, "LeftLowArm"));
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<kinematics::Observation> seen = see(truth);
  for (const char* hidden : {"LElbowOut", "LWristIn", "LWristOut", "LHandIn", "LHandOut"})
    seen = without(seen, marker_named(set, hidden));
  SkeletonTracker body(set, {});
  ASSERT_TRUE(body.start(see(truth), at(0)));
  body.predict(at(1));
  (void)body.update(seen);
  std::vector<Pose> elsewhere(body.pose().locals().begin(), body.pose().locals().end());
  const Eigen::Quaterniond fitted = elsewhere[elbow].rotation;
  elsewhere[elbow].rotation = kinematics::from_rotation_vector({0.0, 0.0, -0.4}) * fitted;

  (void)body.evaluate_from(elsewhere, {}, seen, 1e9);

  EXPECT_LT(test::angle_between(body.pose().locals()[elbow].rotation, fitted), 0.05);
}

// Only one marker of a hand is observed, and it may be either of two. The choice determines the twist of the hand.
TEST(SkeletonTracker, FindsALowerCostForASameBoneMarkerFromTheOtherHypothesis) {
  const MarkerSet set = person("baseline41");
  const auto in = static_cast<int>(marker_named(set, "LHandIn"));
  const auto out = static_cast<int>(marker_named(set, "LHandOut"));
  const std::vector<SkeletonTracker::MarkerSwing> swings{{in, out}};
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  std::mt19937 random(5);
  int better = 0;

  for (int i = 0; i < 100; ++i) {
    truth.set_locals(test::random_pose(set, 0.8, random));
    const std::vector<kinematics::Observation> all = see(truth);
    SkeletonTracker body(set, {.outlier_m = 0.02, .max_iterations = 4});
    ASSERT_TRUE(body.start(all, at(0)));
    std::vector<kinematics::Observation> seen = without(all, static_cast<std::size_t>(in));
    for (const char* hidden : {"LWristIn", "LWristOut"}) seen = without(seen, marker_named(set, hidden));
    for (int n = 1; n < 30; ++n) {
      body.predict(at(n));
      (void)body.update(seen);
      body.commit(seen);
    }
    std::vector<kinematics::Observation> other_label = seen;
    for (kinematics::Observation& one : other_label) {
      if (one.marker == out) one.marker = in;
    }
    (void)body.evaluate_hypothesis(seen);
    const std::vector<Pose> start_pose(body.pose().locals().begin(), body.pose().locals().end());

    const double cost = body.evaluate_hypothesis(other_label).cost;
    better += body.evaluate_from(start_pose, swings, other_label, cost).cost < cost - 0.5 ? 1 : 0;
  }

  EXPECT_GT(better, 5);
}

// A swinging knee whose markers all hide while it bends fast.
TEST(SkeletonTracker, DoesNotExtrapolateTheBendOfAHiddenKnee) {
  const MarkerSet set = person("baseline41");
  const auto knee = static_cast<std::size_t>(bone_named(set, "LeftLowLeg"));
  const auto foot = static_cast<std::size_t>(bone_named(set, "LeftFoot"));
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  constexpr int kHidden = 64;

  for (int step = 0; step <= kHidden + 24; ++step) {
    std::vector<Pose> locals = swinging(set, step);
    locals[knee].rotation =
        kinematics::from_rotation_vector({0.0, 0.9 + 0.8 * std::sin(6.0 * (step - kHidden) * kStep_s + 0.7), 0.0});
    truth.set_locals(locals);
    std::vector<kinematics::Observation> seen = see(truth);
    if (step >= kHidden) {
      std::erase_if(seen, [&](const kinematics::Observation& one) {
        const int on = set.markers[static_cast<std::size_t>(one.marker)].bone;
        return on == static_cast<int>(knee) || on == static_cast<int>(foot);
      });
    }
    follow(body, seen, at(step));
    // m; a shin is 0.4 m long, and an extrapolation at constant velocity would have an error of 0.7 of it.
    EXPECT_LT((body.pose().world()[foot].position - truth.world()[foot].position).norm(), 0.2) << step - kHidden;
  }
}

// An arm swings as in running, and only one marker of the forearm is observed: the collar bone must not follow.
TEST(SkeletonTracker, RotatesNoCollarBoneFarForALoneMarkerOfTheForearm) {
  const MarkerSet set = person("baseline41");
  const auto collar = static_cast<std::size_t>(bone_named(set, "RightCollar"));
  const auto upper = static_cast<std::size_t>(bone_named(set, "RightUpArm"));
  const auto lower = static_cast<std::size_t>(bone_named(set, "RightLowArm"));
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});

  for (int step = 0; step < 240; ++step) {
    std::vector<Pose> locals = swinging(set, step);
    const double swing = 1.0 * std::sin(15.0 * step * kStep_s);
    locals[upper].rotation =
        kinematics::from_rotation_vector({0.0, 0.0, swing}) * kinematics::from_rotation_vector({1.1, 0.0, 0.0});
    locals[lower].rotation = kinematics::from_rotation_vector({0.0, 0.0, 1.3});
    truth.set_locals(locals);
    std::vector<kinematics::Observation> seen = see(truth);
    if (step >= 60) {
      for (const char* hidden :
           {"RShoulderTop", "RShoulderBack", "RUArmHigh", "RElbowOut", "RWristOut", "RHandIn", "RHandOut"})
        seen = without(seen, marker_named(set, hidden));
    }
    follow(body, seen, at(step));
    EXPECT_LT(kinematics::rotation_vector(body.pose().locals()[collar].rotation).norm(), 0.6) << step;
    EXPECT_LT((body.pose().world()[lower].position - truth.world()[lower].position).norm(), 0.2) << step;
  }
}

}  // namespace skeleton_tracker_test
}  // namespace mocap::pose
