#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "label/label_world.h"

namespace mocap::label {
namespace reassociate_limb_test {

using test::LabelWorld;
using test::markers_of;
using test::moving_later;

TEST(ReassociateLimb, LabelsALegThatMovedWhileHiddenAmongManyDistantLights) {
  LabelWorld world;
  world.add("baseline41", moving_later({{"LeftUpLeg", {0.0, -1.1, 0.0}}, {"LeftLowLeg", {0.0, 1.3, 0.0}}}));
  world.identify_all();
  world.step(110);
  auto& one = world.actor();
  const auto leg = markers_of(one, "LeftUpLeg LeftLowLeg LeftFoot");
  for (const std::size_t m : leg) one.tracks[m].hidden = true;
  world.step(70);

  // On a wall beside the leg, at half a metre.
  const Eigen::Vector3d beside = one.place_m + Eigen::Vector3d(0.1, 0.55, -0.3);
  for (int i = 0; i < 60; ++i)
    world.clutter.push_back(beside + Eigen::Vector3d(0.05 * (i % 6), 0.0, -0.06 * static_cast<double>(i / 6)));
  for (const std::size_t m : leg) world.reappear(one.tracks[m]);
  world.step(10);

  EXPECT_EQ(world.wrong_count(), 0);
  for (const std::size_t m : leg) EXPECT_TRUE(world.is_correct(m)) << one.set.markers[m].name;
}

// An arm that swung down while it was hidden: its markers return half a metre and more from their predictions.
TEST(ReassociateLimb, LabelsAnArmThatReturnsFarFromItsPrediction) {
  LabelWorld world;
  world.add("baseline41", moving_later({{"LeftUpArm", {1.2, 0.0, 0.0}}}));
  world.identify_all();
  world.step(110);
  auto& one = world.actor();
  const auto far = markers_of(one, "LeftLowArm LeftHand");
  const auto unseen = markers_of(one, "LeftUpArm LeftLowArm LeftHand");
  for (const std::size_t m : unseen) one.tracks[m].hidden = true;
  world.step(70);

  for (const std::size_t m : far) world.reappear(one.tracks[m]);
  world.step(20);

  EXPECT_EQ(world.wrong_count(), 0);
  for (const std::size_t m : far) EXPECT_TRUE(world.is_correct(m)) << one.set.markers[m].name;
}

// A knee that bent by 110 degrees while the only marker of the shin was hidden: it returns 0.68 m from its prediction.
TEST(ReassociateLimb, LabelsAFootAtTheOtherEndOfTheReachOfItsShin) {
  LabelWorld world;
  world.add("openmocap18", moving_later({{"LeftLowLeg", {0.0, 1.9, 0.0}}}));
  world.identify_all();
  world.step(110);
  auto& one = world.actor();
  const std::size_t foot = world.marker("LeftFoot");
  one.tracks[foot].hidden = true;
  world.step(70);

  world.reappear(one.tracks[foot]);
  world.step(20);

  EXPECT_EQ(world.wrong_count(), 0);
  EXPECT_TRUE(world.is_correct(foot));
}

// One marker of a forearm that moved while hidden may be any of four.
TEST(ReassociateLimb, GivesALoneMarkerOfALimbNoWrongLabel) {
  for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) {
    LabelWorld world;
    world.add("baseline41", moving_later({{"LeftUpArm", {0.0, 0.0, -0.5}}, {"LeftLowArm", {0.0, 0.5, -1.2}}}));
    world.identify_all();
    world.step(110);
    auto& one = world.actor();
    for (const std::size_t m : markers_of(one, "LeftLowArm LeftHand")) one.tracks[m].hidden = true;
    world.step(70);

    world.reappear(one.tracks[world.marker(name)]);

    for (int set = 0; set < 30; ++set) {
      world.step();
      ASSERT_EQ(world.wrong_count(), 0) << name << " in set " << set;
    }
  }
}

// The rotations of the left arm, out of 4000 random ones, that bring its wrist nearest to the waist.
test::Motion hand_at_the_waist() {
  const MarkerSet set = test::person("baseline41");
  kinematics::PoseFit pose(set, kinematics::PoseFit::Lengths::Fixed);
  std::size_t wrist = 0, waist = 0;
  while (set.markers[wrist].name != "LWristIn") ++wrist;
  while (set.markers[waist].name != "WaistLFront") ++waist;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<std::pair<std::string, Eigen::Vector3d>> best;
  double nearest_m = 1.0;
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector3d upper(-1.2 + 0.4 * any(random), 0.6 * any(random), 0.6 * any(random));
    const Eigen::Vector3d lower(0.1 * any(random), 0.5 * any(random), -1.0 + 0.9 * any(random));
    std::vector<Pose> locals(pose.locals().begin(), pose.locals().end());
    for (std::size_t b = 0; b < locals.size(); ++b) {
      if (set.skeleton.bones[b].name == "LeftUpArm") locals[b].rotation = kinematics::from_rotation_vector(upper);
      if (set.skeleton.bones[b].name == "LeftLowArm") locals[b].rotation = kinematics::from_rotation_vector(lower);
    }
    pose.set_locals(locals);
    const double apart_m = (pose.marker_at(wrist) - pose.marker_at(waist)).norm();
    if (apart_m >= nearest_m) continue;
    nearest_m = apart_m;
    best = {{"LeftUpArm", upper}, {"LeftLowArm", lower}};
  }
  EXPECT_LT(nearest_m, 0.03);
  return test::into_posture(best);
}

TEST(ReassociateLimb, AssignsNoMarkerThatMayBelongToAnotherLimb) {
  LabelWorld world;
  world.add("baseline41", hand_at_the_waist());
  world.identify_all();
  world.step(200);
  auto& one = world.actor();
  for (const char* name : {"WaistLFront", "LWristIn", "LWristOut", "LHandOut", "LElbowOut"})
    one.tracks[world.marker(name)].hidden = true;
  world.step(40);

  world.reappear(one.tracks[world.marker("WaistLFront")]);

  for (int set = 0; set < 30; ++set) {
    world.step();
    ASSERT_EQ(world.wrong_count(), 0) << "in set " << set;
  }
}

// An arm that swings at `fast_rad_s` and reverses within a set, 2 s after the T-pose.
test::Motion reversing_arm(double fast_rad_s) {
  return [fast_rad_s](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    const double swung = fast_rad_s * (0.3 - std::abs(t_s - 2.0));
    const double share = std::clamp(swung, 0.0, 2.0);
    if (bone == "LeftUpArm") return kinematics::from_rotation_vector({0.0, 0.2 * share, -0.5 * share});
    if (bone == "LeftLowArm") return kinematics::from_rotation_vector({0.0, 0.0, -share});
    if (bone == "LeftHand") return kinematics::from_rotation_vector({0.3 * share, 0.0, -0.3 * share});
    return Eigen::Quaterniond::Identity();
  };
}

// The tracks of a hand that reverses are discontinuous, and its neighbours are hidden: no hidden neighbour gets the
// track.
TEST(ReassociateLimb, KeepsAHandThatReversesWithinASetFromItsHiddenNeighbours) {
  for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) {
    for (const int sets_before : {15, 5}) {
      LabelWorld world;
      world.add("baseline41", reversing_arm(15.0));
      world.identify_all();
      world.step(240 - sets_before);
      auto& one = world.actor();
      const std::size_t alone = world.marker(name);
      for (const std::size_t m : markers_of(one, "LeftLowArm LeftHand")) one.tracks[m].hidden = m != alone;
      int wrong = 0;
      for (int set = 0; set < 50; ++set) {
        world.step();
        wrong += world.wrong_count() > 0 ? 1 : 0;
      }
      EXPECT_EQ(wrong, 0) << name << " hidden " << sets_before << " sets before";
    }
  }
}

}  // namespace reassociate_limb_test
}  // namespace mocap::label
