#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "label/label_world.h"

namespace mocap::label {
namespace lost_limbs_test {

using test::LabelWorld;
using test::markers_of;
using test::moving_later;
using Rotations = std::vector<std::pair<std::string, Eigen::Vector3d>>;

constexpr int kVisibleSets = 120;  // sets, until the limb is hidden
constexpr int kHiddenSets = 70;    // sets, in which the limb moves

Rotations any_leg(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0), share(0.0, 1.0);
  return {{"LeftUpLeg", {0.4 * any(random), 0.7 * any(random) - 0.4, 0.4 * any(random)}},
          {"LeftLowLeg", {0.0, 1.4 * share(random), 0.2 * any(random)}},
          {"LeftFoot", {0.3 * any(random), 0.4 * any(random), 0.3 * any(random)}}};
}

// From the T-pose into a posture, and from 1.0 s to 1.5 s into another.
test::Motion from_posture_to_posture(const Rotations& from, const Rotations& to) {
  return [from, to](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    const double in = std::min(1.0, t_s / 0.8);
    const double share = std::clamp((t_s - 1.0) / 0.5, 0.0, 1.0);
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (from[i].first == bone)
        return kinematics::from_rotation_vector(in * ((1.0 - share) * from[i].second + share * to[i].second));
    }
    return Eigen::Quaterniond::Identity();
  };
}

void hide(LabelWorld& world, const std::vector<std::size_t>& markers) {
  for (const std::size_t m : markers) world.actor().tracks[m].hidden = true;
}

void reappear(LabelWorld& world, const std::vector<std::size_t>& markers) {
  for (const std::size_t m : markers) world.reappear(world.actor().tracks[m]);
}

// Many assignments satisfy the distances, including reflected and exchanged assignments. For one leg in twenty, the six
// cheapest assignments do not include the true assignment.
TEST(LostLimb, ALegThatMovedWhileHiddenHasAllLabelsWithinTenSets) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    LabelWorld world;
    const Rotations from = any_leg(random), to = any_leg(random);
    world.add("baseline41", from_posture_to_posture(from, to));
    world.identify_all();
    world.step(kVisibleSets);
    const auto leg = markers_of(world.actor(), "LeftUpLeg LeftLowLeg LeftFoot");
    hide(world, leg);
    world.step(kHiddenSets);

    reappear(world, leg);

    for (int set = 0; set < 10; ++set) {
      world.step();
      EXPECT_EQ(world.wrong_count(), 0) << seed << " set " << set;
    }
    EXPECT_EQ(world.correct_count(), world.marker_count()) << seed;
  }
}

// The upper arm stays hidden, and the hand returns farther from its prediction than the reach of the forearm.
TEST(LostLimb, AForearmIsLabelledTogetherWithItsHiddenUpperArm) {
  for (const double down_rad : {1.4, 1.5, 1.6}) {
    LabelWorld world;
    world.add("baseline41", moving_later({{"LeftUpArm", {down_rad, 0.0, 0.0}}}));
    world.identify_all();
    world.step(kVisibleSets);
    const auto forearm = markers_of(world.actor(), "LeftLowArm LeftHand");
    hide(world, markers_of(world.actor(), "LeftUpArm LeftLowArm LeftHand"));
    world.step(kHiddenSets);

    reappear(world, forearm);
    world.step(5);

    EXPECT_EQ(world.wrong_count(), 0) << down_rad;
    for (const std::size_t m : forearm) EXPECT_TRUE(world.is_correct(m)) << down_rad << ' ' << m;
  }
}

// An arm hangs down beside a raised leg.
Rotations arm_by_a_leg(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0), share(0.0, 1.0);
  return {{"LeftUpLeg", {0.3 * any(random), -1.5 * share(random), 0.3 * any(random)}},
          {"LeftLowLeg", {0.0, 1.8 * share(random), 0.2 * any(random)}},
          {"LeftUpArm", {-1.5 + 0.3 * any(random), 0.4 * any(random), 0.4 * any(random)}},
          {"LeftLowArm", {0.0, 0.0, -0.8 * share(random)}}};
}

// Both limbs reach the two wrist markers that are detected: neither limb gets these tracks until more markers resolve
// the ambiguity.
TEST(LostLimb, ALegIsNotAssignedTheAmbiguousTracksOfALostArm) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    LabelWorld world;
    const Rotations from = arm_by_a_leg(random), to = arm_by_a_leg(random);
    world.add("baseline41", from_posture_to_posture(from, to));
    world.identify_all();
    world.step(kVisibleSets);
    const auto arm = markers_of(world.actor(), "LeftUpArm LeftLowArm LeftHand");
    const auto leg = markers_of(world.actor(), "LeftUpLeg LeftLowLeg LeftFoot");
    hide(world, arm);
    hide(world, leg);
    world.step(kHiddenSets);

    reappear(world, markers_of(world.actor(), "LeftLowArm"));

    for (int set = 0; set < 20; ++set) {
      world.step();
      EXPECT_EQ(world.wrong_count(), 0) << seed << " set " << set;
    }
    reappear(world, arm);
    reappear(world, leg);
    world.step(20);
    EXPECT_EQ(world.correct_count(), world.marker_count()) << seed;
  }
}

// Both arms reach forward, and the hands are near each other.
Rotations arms_before(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0), share(0.0, 1.0);
  const double up_rad = 0.3 * any(random) - 0.6, aside_rad = 0.2 * any(random) - 1.3;
  return {{"LeftUpArm", {0.3 * any(random) + up_rad, 0.0, 0.2 * any(random) + aside_rad}},
          {"LeftLowArm", {0.0, 0.0, -0.8 * share(random)}},
          {"RightUpArm", {0.3 * any(random) - up_rad, 0.0, 0.2 * any(random) - aside_rad}},
          {"RightLowArm", {0.0, 0.0, 0.8 * share(random)}}};
}

// Both arms are hidden; one holds its posture, the other moves. The forearm that reappears is that of the first arm, by
// the predictions of both. Of 5000 labels (5 markers, 20 sets, 50 postures) 15 are wrong, and 79 without the rule that
// the less likely limb waits (decision 0018). The bound is half of that.
TEST(LostLimb, AnArmIsNotAssignedTheForearmOfTheOtherLostArm) {
  int wrong_count = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    LabelWorld world;
    const Rotations from = arms_before(random);
    Rotations to = arms_before(random);
    const bool left = seed % 2 == 0;
    std::copy_n(from.begin() + (left ? 0 : 2), 2, to.begin() + (left ? 0 : 2));
    world.add("baseline41", from_posture_to_posture(from, to));
    world.identify_all();
    world.step(kVisibleSets);
    hide(world, markers_of(world.actor(), "LeftCollar LeftUpArm LeftLowArm LeftHand"));
    hide(world, markers_of(world.actor(), "RightCollar RightUpArm RightLowArm RightHand"));
    world.step(40);

    reappear(world, markers_of(world.actor(), left ? "LeftLowArm LeftHand" : "RightLowArm RightHand"));
    reappear(world, {world.marker(left ? "LElbowOut" : "RElbowOut")});

    for (int set = 0; set < 20; ++set) {
      world.step();
      wrong_count += world.wrong_count();
    }
  }
  EXPECT_LT(wrong_count, 40);
}

struct HiddenArm : testing::Test {
  HiddenArm() {
    world.add("baseline41", test::walking());
    world.identify_all();
    world.step(kVisibleSets);
    hide(world, markers_of(world.actor(), "LeftUpArm LeftLowArm LeftHand"));
    world.step(30);
  }

  LabelWorld world;
};

TEST_F(HiddenArm, AMarkerThatMayBeItsNeighbourIsLabelledWhenTheNeighbourReturns) {
  const std::size_t elbow = world.marker("LElbowOut"), high = world.marker("LUArmHigh");
  world.reappear(world.actor().tracks[elbow]);
  world.step(5);
  EXPECT_NE(world.label(elbow).state, LabelState::Measured);

  world.reappear(world.actor().tracks[high]);
  world.step(3);

  EXPECT_TRUE(world.is_correct(elbow) && world.is_correct(high));
  EXPECT_EQ(world.wrong_count(), 0);
}

TEST_F(HiddenArm, ALightBesideItGetsNoLabel) {
  for (const char* name : {"LElbowOut", "LUArmHigh"}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double off_m : {-0.03, 0.03}) {
        world.clutter = {world.true_position(world.marker(name)) + off_m * Eigen::Vector3d::Unit(axis)};
        for (int set = 0; set < 3; ++set) {
          world.step();
          EXPECT_EQ(world.wrong_count(), 0) << name << ' ' << axis << ' ' << off_m;
        }
        world.clutter.clear();
        world.step(5);
      }
    }
  }
}

}  // namespace lost_limbs_test
}  // namespace mocap::label
