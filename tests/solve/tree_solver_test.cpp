#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kinematics/rotation.h"
#include "solve/solve_world.h"
#include "support/test_body.h"

namespace mocap::solve {
namespace {

using test::kStep_s;
using World = test::SolveWorld;

TEST(SolveSkeleton, FindsJointsAndTurnsOfAMovingBody) {
  World world("baseline41");
  world.noise(0.0002);
  double place2 = 0.0, turn2 = 0.0;
  int count = 0;

  for (int i = 0; i < 360; ++i) {
    world.step();
    for (std::size_t b = 0; b < world.set().skeleton.bones.size(); ++b) {
      place2 += std::pow(world.off_m(b), 2);
      turn2 += std::pow(test::angle_between(world.shown(b).world_from_bone.rotation, world.true_bone(b).rotation), 2);
      ++count;
    }
  }

  // 0.2 mm on levers of 6 cm and more, and the pull of priors; the issue asks for 3 mm and 1 degree.
  EXPECT_LT(std::sqrt(place2 / count), 0.0005);
  EXPECT_LT(std::sqrt(turn2 / count), 0.010);
}

TEST(SolveSkeleton, ABodyKnownAnewInTheMidstOfASwingDoesNotStray) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    World world(set);
    world.pace(0.0);
    world.step(120);
    world.pace(4.0);
    world.step(4);
    world.refit();

    double most_m = 0.0;
    for (int i = 0; i < 24; ++i) {
      world.step();
      for (std::size_t b = 0; b < world.set().skeleton.bones.size(); ++b) most_m = std::max(most_m, world.off_m(b));
    }

    // Nothing is known otherwise than before; the fit's own error is under a millimetre.
    EXPECT_LT(most_m, 0.002) << set;
  }
}

TEST(SolveSkeleton, AHandThatShowsOneMarkerKeepsItsTurn) {
  World world("baseline41");
  world.pace(0.0);
  world.bend_left_hand({-0.4, 0.15, -0.95});  // farther than hands commonly are
  world.step(60);
  world.show(world.marker("LHandIn"), false);
  world.step(84);  // 0.7 s

  const std::size_t hand = world.bone("LeftHand");
  const double off_rad = world.shown(hand).world_from_bone.rotation.angularDistance(world.true_bone(hand).rotation);
  // What is common takes over within seconds, not at once.
  EXPECT_LT(off_rad, 0.1);
}

TEST(SolveSkeleton, LocalPosesMakeUpTheWorldPoses) {
  World world("baseline41", {.smoothing = {.min_cutoff_hz = 2.0}});
  world.step(50);

  for (std::size_t b = 1; b < world.set().skeleton.bones.size(); ++b) {
    const auto parent = static_cast<std::size_t>(world.set().skeleton.bones[b].parent);
    const Pose made = world.shown(parent).world_from_bone * world.shown(b).parent_from_bone;

    EXPECT_LT((made.position - world.shown(b).world_from_bone.position).norm(), 1e-9);
    EXPECT_LT(test::angle_between(made.rotation, world.shown(b).world_from_bone.rotation), 1e-9);
  }
}

TEST(SolveSkeleton, NothingJumpsWhenMarkersComeAndGo) {
  World world("baseline41");
  std::mt19937 random(5);
  std::uniform_int_distribution<int> which(0, 40);
  std::vector<int> hidden_for(41, 0);
  std::vector<Eigen::Vector3d> last(18), before(18), true_last(18), true_before(18);
  double most = 0.0, true_most = 0.0, astray = 0.0;

  for (int i = 0; i < 960; ++i) {
    for (std::size_t m = 0; m < 41; ++m) {
      if (hidden_for[m] > 0) --hidden_for[m];
      world.show(m, hidden_for[m] == 0);
    }
    // Twice in a second a whole forearm and hand are hidden for 0.3 s, and a marker every 50 ms for 0.5 s.
    if (i > 120 && i % 6 == 0) hidden_for[static_cast<std::size_t>(which(random))] = 60;
    if (i > 120 && i % 60 == 0) {
      for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) hidden_for[world.marker(name)] = 36;
    }
    world.step();
    for (std::size_t b = 0; b < 18; ++b) {
      const Eigen::Vector3d now = world.shown(b).world_from_bone.position, truth = world.true_bone(b).position;
      if (i > 2) most = std::max(most, (now - 2.0 * last[b] + before[b]).norm());
      if (i > 2) true_most = std::max(true_most, (truth - 2.0 * true_last[b] + true_before[b]).norm());
      astray = std::max(astray, world.off_m(b));
      before[b] = last[b];
      last[b] = now;
      true_before[b] = true_last[b];
      true_last[b] = truth;
    }
  }

  EXPECT_GT(astray, 0.05);  // hidden limbs do go astray, so that there is something to come back from
  // A spring of 40 ms moves what is 1 m away by 1 m (dt / 40 ms)^2 in its first set; a fifth for what else there is.
  EXPECT_LT(most, true_most + 1.2 * astray * std::pow(kStep_s / 0.04, 2));
}

TEST(SolveSkeleton, HiddenJointsAreWithin30Mm) {
  World world("baseline41");
  std::mt19937 random(6);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::vector<int> hidden_for(41, 0);
  double sum = 0.0;
  int count = 0;

  for (int i = 0; i < 1200; ++i) {
    std::vector<int> seen(18, 0);
    for (std::size_t m = 0; m < 41; ++m) {
      // 30 % of the time hidden, 60 sets each.
      if (hidden_for[m] > 0) --hidden_for[m];
      if (i > 60 && hidden_for[m] == 0 && chance(random) < 0.3 / 0.7 / 60.0) hidden_for[m] = 60;
      world.show(m, hidden_for[m] == 0);
      if (hidden_for[m] == 0) ++seen[static_cast<std::size_t>(world.set().markers[m].bone)];
    }
    world.step();
    for (std::size_t b = 0; b < 18; ++b) {
      if (seen[b] > 0) continue;
      sum += std::pow(world.off_m(b), 2);
      ++count;
    }
  }

  ASSERT_GT(count, 500);
  EXPECT_LT(std::sqrt(sum / count), 0.030);
}

TEST(SolveSkeleton, AHiddenLimbStaysAndDoesNotSnapToRest) {
  World world("openmocap18");
  const std::size_t wrist = world.bone("LeftHand"), elbow = world.bone("LeftLowArm");
  world.step(120);
  world.show(world.marker("LeftHand"), false);
  world.step(24);  // what it was on has died away
  const auto bend = [&] { return kinematics::rotation_vector(world.shown(elbow).parent_from_bone.rotation).norm(); };
  const double after = bend();

  world.step(96);

  EXPECT_LT(world.shown(wrist).confidence, 0.5F);
  EXPECT_NEAR(bend(), after, 0.15);  // of 0.2 to 1.2 rad; rest is 0
}

TEST(SolveSkeleton, ConfidenceFallsWithTheTimeHiddenAndComesBack) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand"), wrist = world.bone("LeftHand");
  world.step(60);
  const float seen = world.shown(wrist).confidence;
  world.show(hand, false);
  world.step(3);
  const float soon = world.shown(wrist).confidence;
  world.step(40);
  const float late = world.shown(wrist).confidence;
  world.show(hand, true);
  world.step(2);

  EXPECT_GT(seen, soon);
  EXPECT_GT(soon, late);
  EXPECT_LT(late, 0.3F);
  EXPECT_GT(world.shown(wrist).confidence, late + 0.3F);
}

TEST(SolveSkeleton, VelocitiesAreTheSlopesOfTheTruth) {
  World world("baseline41");
  const std::size_t arm = world.bone("LeftLowArm");
  world.step(200);
  std::vector<Pose> truth;
  for (int i = 0; i < 9; ++i) {
    truth.push_back(world.true_bone(arm));
    if (i < 8) world.step();
  }

  // Over about 20 ms: 2.4 sets; the slope in the middle of as many.
  const Eigen::Vector3d velocity = (truth[8].position - truth[3].position) / (5 * kStep_s);
  const Eigen::Vector3d spin =
      kinematics::rotation_vector(truth[8].rotation * truth[3].rotation.conjugate()) / (5 * kStep_s);
  EXPECT_GT(velocity.norm(), 0.2);
  EXPECT_GT(spin.norm(), 0.5);
  EXPECT_LT((world.shown(arm).velocity_m_s - velocity).norm(), 0.05 * std::max(1.0, velocity.norm()));
  EXPECT_LT((world.shown(arm).spin_rad_s - spin).norm(), 0.15);
}

TEST(SolveSkeleton, SmoothingTellsHowLateItIs) {
  World plain("baseline41"), smooth("baseline41", {.smoothing = {.min_cutoff_hz = 2.0, .beta = 0.0}});
  plain.step(10);
  smooth.step(10);

  EXPECT_EQ(plain.pose().smoothing_delay_s, 0.0);
  EXPECT_NEAR(smooth.pose().smoothing_delay_s, 1.0 / (2.0 * 3.14159265 * 2.0), 1e-6);
}

TEST(SolveSkeleton, StaysFiniteWhateverTheLabelsSay) {
  World world("baseline41");
  world.step(10);
  const double nan = std::nan("");
  world.spoil(3, {nan, nan, nan});
  world.spoil(7, {1e12, 0.0, 0.0});
  world.spoil(9, {INFINITY, 0.0, 0.0});
  world.see_by_ray(5, {nan, 0.0, 0.0});

  world.step(10);

  for (const BonePose& bone : world.pose().bones) {
    EXPECT_TRUE(bone.world_from_bone.position.allFinite());
    EXPECT_NEAR(bone.world_from_bone.rotation.norm(), 1.0, 1e-9);
    EXPECT_TRUE(bone.velocity_m_s.allFinite() && bone.spin_rad_s.allFinite());
    EXPECT_TRUE(std::isfinite(bone.confidence));
  }
}

}  // namespace
}  // namespace mocap::solve
