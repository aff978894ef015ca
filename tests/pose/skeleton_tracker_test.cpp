#include "pose/skeleton_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace {

using test::bone_named;
using test::marker_named;
using test::person;
using test::see;
using test::without;

constexpr double kStep_s = 1.0 / 60.0;

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set * kStep_s); }

// Walks along x and swings both arms forth and back, down at the sides.
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

TEST(SkeletonTracker, KeepsAHiddenShoulderWhereItIsForHalfASecond) {
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

    // What a person who sees the picture expects of a hidden joint.
    EXPECT_LT((body.predicted_position(hidden) - truth.marker_at(hidden)).norm(), 0.03) << step;
  }
}

TEST(SkeletonTracker, TellsAHiddenMarkerLessSurelyTheLongerItIsHidden) {
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
  // The forearm, along y, does not stretch: sure along it, unsure where the elbow bends.
  EXPECT_LT(std::sqrt(late(1, 1)), 0.02);
  EXPECT_GT(std::sqrt(late(0, 0)), 0.10);
}

TEST(SkeletonTracker, FindsAHandThatComesOutElsewhere) {
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

// A leg that swings forth stretches and bends again.
TEST(SkeletonTracker, BendsAKneeForthOnlyOfWhichFootAndHipAloneAreSeen) {
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

    // On the wrong side it would be off by 0.5 m in the end; a stretched leg hardly tells how far its knee is aside.
    const Eigen::Vector3d off =
        body.pose().world()[bone("RightLowLeg")].position - truth.world()[bone("RightLowLeg")].position;
    EXPECT_LT(off.norm(), step < 17 ? 0.15 : 0.06) << step;
  }
}

TEST(SkeletonTracker, LaysALimbAnewThatIsTurnedTheWrongWayRound) {
  const MarkerSet set = person("baseline41");
  const std::size_t in = marker_named(set, "LWristIn");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  std::vector<kinematics::Observation> swapped = see(truth);
  std::swap(swapped[in].position, swapped[marker_named(set, "LWristOut")].position);
  ASSERT_TRUE(body.start(swapped, at(0)));

  body.predict(at(1));
  (void)body.update(see(truth));

  // It was 80 mm off; what one set's hold leaves is gone with the next.
  EXPECT_LT((body.predicted_position(in) - truth.marker_at(in)).norm(), 0.015);
}

TEST(SkeletonTracker, LaysALimbAnewOnlyForAReadingThatMayComeWithin) {
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

  int laid_anew = 0;
  for (int i = 1; i <= 20; ++i) {
    const std::vector<kinematics::Observation> seen = with_arm_bent(0.1 * i);
    const double cost = body.evaluate_hypothesis(seen).cost;
    const double at_once = body.evaluate_hypothesis(seen, -1e9).cost;
    laid_anew += at_once > cost ? 1 : 0;

    EXPECT_GE(at_once, cost) << i;
    EXPECT_EQ(body.evaluate_hypothesis(seen, cost).cost, cost) << i;  // whatever may come within is told as it is
  }
  EXPECT_GT(laid_anew, 5);
}

// A lone marker of an arm that is seen elsewhere than thought turns joints that no other marker tells of.
TEST(SkeletonTracker, TakesForNoMotionThatALoneMarkerIsElsewhere) {
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

// A forearm that nobody sees is where the last fit has it, wherever a reading's pose is looked for.
TEST(SkeletonTracker, HoldsToItsLastFitWhereverTheSearchBegins) {
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

// Of a hand one marker alone is seen, and it may be either of two: which of them turns the hand about itself.
TEST(SkeletonTracker, ExplainsATwinNearWhereTheOtherLedTo) {
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
    std::vector<kinematics::Observation> twin = seen;
    for (kinematics::Observation& one : twin) {
      if (one.marker == out) one.marker = in;
    }
    (void)body.evaluate_hypothesis(seen);
    const std::vector<Pose> led_to(body.pose().locals().begin(), body.pose().locals().end());

    const double cost = body.evaluate_hypothesis(twin).cost;
    better += body.evaluate_from(led_to, swings, twin, cost).cost < cost - 0.5 ? 1 : 0;
  }

  EXPECT_GT(better, 5);
}

// A knee that swings, and of which nobody sees anything from where it is bent far and fast on.
TEST(SkeletonTracker, DoesNotBendOnAKneeThatHides) {
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
    // A shin is 0.4 m long; 0.7 of it is what a straight line would end at.
    EXPECT_LT((body.pose().world()[foot].position - truth.world()[foot].position).norm(), 0.2) << step - kHidden;
  }
}

// An arm that runs, of which the forearm's one marker is seen: the collar bone must not follow it.
TEST(SkeletonTracker, TurnsNoCollarBoneFarForALoneMarkerOfTheForearm) {
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

}  // namespace
}  // namespace mocap::pose
