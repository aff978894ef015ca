#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace resolve_depth_ambiguity_test {

using test::bone_named;
using test::marker_named;
using test::person;
using test::see;
using test::without;

constexpr double kStep_s = 1.0 / 60.0;

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set * kStep_s); }

// The left elbow straightens and bends again. While it is nearly straight, all markers beyond the elbow hide, except
// that one camera sees one marker of the hand. The camera looks along the path of the marker, so the way back lies on
// the same rays. The right forearm is hidden meanwhile, and the reinitialisation of the left forearm must not move it.
TEST(SkeletonTracker, ReinitialisesALimbAtTheOtherIntersectionOfRayAndReachSphere) {
  const MarkerSet set = person("baseline41");
  const auto elbow = bone_named(set, "LeftLowArm");
  const std::size_t hand = bone_named(set, "LeftHand");
  const auto right_elbow = bone_named(set, "RightLowArm");
  const std::size_t right_hand = bone_named(set, "RightHand");
  const std::size_t on_hand = marker_named(set, "LHandOut");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
  locals[right_elbow].rotation = kinematics::from_rotation_vector({0.0, 0.0, 1.5});
  const auto bend = [&](double by_rad) {
    locals[elbow].rotation = kinematics::from_rotation_vector({0.0, 0.0, -by_rad});
    truth.set_locals(locals);
  };
  bend(0.1);
  const Eigen::Vector3d joint = truth.world()[elbow].position;
  const Eigen::Vector3d nearest = truth.marker_at(on_hand);
  const Eigen::Vector3d eye = nearest + 4.0 * (nearest - joint).cross(Eigen::Vector3d::UnitZ()).normalized();
  SkeletonTracker body(set, {});

  for (int step = 0; step <= 90; ++step) {
    bend(0.6 + 0.55 * std::cos(step * 0.07));  // minimum 0.05 rad at step 45
    std::vector<kinematics::Observation> seen;
    for (const kinematics::Observation& one : see(truth)) {
      const auto on = static_cast<std::size_t>(set.markers[static_cast<std::size_t>(one.marker)].bone);
      const bool beyond_elbows = on == elbow || on == hand ||  //
                                 on == right_elbow || on == right_hand;
      if (step < 40 || !beyond_elbows) seen.push_back(one);
    }
    if (!body.is_tracking()) {
      ASSERT_TRUE(body.start(seen, at(step)));
      continue;
    }
    body.predict(at(step));
    if (step >= 40) {
      const Eigen::Vector3d ray = (truth.marker_at(on_hand) - eye).normalized();
      seen.push_back(
          kinematics::observe_ray(static_cast<int>(on_hand), eye, ray, 1e-4, body.predicted_position(on_hand), 0.002));
    }
    (void)body.update(seen);
    body.commit(seen);
  }

  EXPECT_LT((body.pose().world()[hand].position - truth.world()[hand].position).norm(), 0.05);
  EXPECT_LT((body.pose().world()[right_hand].position - truth.world()[right_hand].position).norm(), 0.05);
}

// All cameras saw the arm at rest one set ago: it must stay there, even in an unusual posture.
TEST(SkeletonTracker, KeepsALimbThatWasObservedOneSetAgo) {
  const MarkerSet set = person("baseline41");
  const std::size_t on_hand = marker_named(set, "LHandOut");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);

  for (int i = 0; i < 100; ++i) {
    std::vector<Pose> posture = test::random_pose(set, 1.5, random);
    for (const char* joint : {"LeftUpArm", "LeftLowArm", "LeftHand"}) {
      const std::size_t bone = bone_named(set, joint);
      Eigen::Vector3d rotation_rad;
      for (int axis = 0; axis < 3; ++axis) {
        const auto& range = set.skeleton.bones[bone].rotation_limits[static_cast<std::size_t>(axis)];
        rotation_rad[axis] = 0.8 * (anywhere(random) < 0.0 ? range->min_rad : range->max_rad);
      }
      posture[bone].rotation = kinematics::from_rotation_vector(rotation_rad);
    }
    truth.set_locals(posture);
    const Eigen::Vector3d hand = truth.marker_at(on_hand);
    const Eigen::Vector3d eye =
        hand + 4.0 * Eigen::Vector3d(anywhere(random), anywhere(random), 0.4 * anywhere(random)).normalized();
    SkeletonTracker body(set, {});
    ASSERT_TRUE(body.start(see(truth), at(0)));
    for (int step = 1; step < 10; ++step) {
      body.predict(at(step));
      (void)body.update(see(truth));
      body.commit(see(truth));
    }
    std::vector<kinematics::Observation> seen = see(truth);
    for (const char* hidden : {"LUArmHigh", "LElbowOut", "LWristIn", "LWristOut", "LHandIn", "LHandOut"})
      seen = without(seen, marker_named(set, hidden));
    body.predict(at(10));
    seen.push_back(kinematics::observe_ray(static_cast<int>(on_hand), eye, (hand - eye).normalized(), 1e-4,
                                           body.predicted_position(on_hand), 0.002));
    (void)body.update(seen);

    EXPECT_LT((body.predicted_position(on_hand) - hand).norm(), 0.1) << i;
  }
}

// A forearm bends, and one camera alone sees the hand, which moves along the ray near the point where the ray touches
// the reach sphere of the hand.
class AtTheTangentPointOfARay : public ::testing::Test {
 protected:
  AtTheTangentPointOfARay() { place_camera(); }

  void place_camera() {
    bend(kTangent_rad);
    const Eigen::Vector3d tangent_point = truth.marker_at(hand);
    bend(kTangent_rad + 1e-6);
    eye = tangent_point - 4.0 * (truth.marker_at(hand) - tangent_point).normalized();
  }
  // Turns the scene about z until the ray to the hand lies along (1, -1, 0) when the elbow is bent by this angle.
  void turn_to_the_diagonal(double bent_rad) {
    bend(bent_rad);
    const Eigen::Vector3d ray = truth.marker_at(hand) - eye;
    yaw_rad = -0.25 * std::numbers::pi - std::atan2(ray.y(), ray.x());
    place_camera();
  }

  void bend(double by_rad) {
    std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
    locals[0].rotation = kinematics::from_rotation_vector({0.0, 0.0, yaw_rad});
    locals[bone_named(set, "LeftLowArm")].rotation = kinematics::from_rotation_vector({0.0, 0.0, -by_rad});
    truth.set_locals(locals);
  }

  // Position error of the hand at the end, m.
  template <class Bent>
  double follow(const Bent& bent_rad, unsigned seed = 3) {
    SkeletonTracker body(set, {});
    std::mt19937 random(seed);
    std::normal_distribution<double> noise_m(0.0, 2e-5);
    for (int step = 0; step <= 90; ++step) {
      bend(bent_rad(step * kStep_s));
      std::vector<kinematics::Observation> seen = see(truth);
      for (kinematics::Observation& one : seen) {
        one.position += Eigen::Vector3d(noise_m(random), noise_m(random), noise_m(random));
        one.sigma_m = kSkin_m;
      }
      const Eigen::Vector3d ray = (seen[hand].position - eye).normalized();
      if (step == 0) {
        EXPECT_TRUE(body.start(seen, at(0)));
      }
      body.predict(at(step));
      if (step >= 30) {
        seen = without(seen, hand);
        seen.push_back(
            kinematics::observe_ray(static_cast<int>(hand), eye, ray, 1e-4, body.predicted_position(hand), kSkin_m));
      }
      (void)body.update(seen);
      body.commit(seen);
    }
    return (body.predicted_position(hand) - truth.marker_at(hand)).norm();
  }

  static constexpr double kTangent_rad = 1.2;
  static constexpr double kSkin_m = 5e-4;
  MarkerSet set = person("openmocap18");
  std::size_t hand = marker_named(set, "LeftHand");
  kinematics::PoseFit truth{set, kinematics::PoseFit::Lengths::Fixed};
  double yaw_rad = 0.0;
  Eigen::Vector3d eye;
};

TEST_F(AtTheTangentPointOfARay, FollowsAHandThatMovesOn) {
  EXPECT_LT(follow([](double t_s) { return 1.2 + 1.1 * (t_s - 1.0); }), 0.01);
}

// The hand is so slow that noise hides the tangent point for a sixth of a second.
TEST_F(AtTheTangentPointOfARay, FollowsMostHandsThatMoveOnSlowly) {
  int wrong = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    if (follow([](double t_s) { return 1.2 + 0.5 * (t_s - 1.0); }, seed) > 0.01) ++wrong;
  }
  EXPECT_LE(wrong, 6);
}

// The ray passes the diagonal, where its largest component changes, 6 mm before and behind the tangent point.
TEST_F(AtTheTangentPointOfARay, FollowsMostHandsThatMoveOnSlowlyOnADiagonal) {
  turn_to_the_diagonal(kTangent_rad + 0.025);
  int wrong = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    if (follow([](double t_s) { return 1.2 + 0.5 * (t_s - 1.0); }, seed) > 0.01) ++wrong;
  }
  EXPECT_LE(wrong, 6);
}

TEST_F(AtTheTangentPointOfARay, FollowsAHandThatPassesAndReturns) {
  EXPECT_LT(follow([](double t_s) { return 1.2 + 0.5 * std::sin(8.0 * (t_s - 1.0)); }), 0.01);
}

TEST_F(AtTheTangentPointOfARay, FollowsAHandThatTurnsBackBeforeIt) {
  EXPECT_LT(follow([](double t_s) { return 0.85 + 0.25 * std::cos(8.0 * (t_s - 1.0)); }), 0.01);
}

}  // namespace resolve_depth_ambiguity_test
}  // namespace mocap::pose
