#include <gtest/gtest.h>

#include <algorithm>

#include "label/label_world.h"

namespace mocap::label {
namespace label_swaps_test {

using test::LabelWorld;

struct Swapped {
  int pairs = 0;
  int max_sets_wrong = 0;          // after one exchange
  int max_sets_until_correct = 0;  // until every label is correct again
  std::string worst;
};

// Exchanges every pair of tracks less than `near_m` apart, one pair after the other, with 12 sets between.
Swapped exchange_all_neighbours(LabelWorld& world, std::size_t other, double near_m) {
  Swapped result;
  auto& one = world.actor(0);
  auto& two = world.actor(other);
  for (std::size_t a = 0; a < one.tracks.size(); ++a) {
    for (std::size_t b = other == 0 ? a + 1 : 0; b < two.tracks.size(); ++b) {
      if ((world.true_position(a, 0) - world.true_position(b, other)).norm() > near_m) continue;
      ++result.pairs;
      world.exchange(one.tracks[a], two.tracks[b]);
      int wrong = 0;
      int until_all = 0;
      for (int i = 0; i < 12; ++i) {
        world.step();
        wrong += world.wrong_count() > 0 ? 1 : 0;
        if (world.correct_count() < world.marker_count()) until_all = i + 1;
      }
      result.max_sets_wrong = std::max(result.max_sets_wrong, wrong);
      if (until_all > result.max_sets_until_correct) {
        result.max_sets_until_correct = until_all;
        result.worst = one.set.markers[a].name + " and " + two.set.markers[b].name;
      }
    }
  }
  return result;
}

TEST(LabelSwaps, OfAnyTwoNeighboursAreCorrectedWithinFiveSets) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    for (const auto& motion : {test::walking(), test::hands_and_feet_together()}) {
      LabelWorld world;
      world.add(set, motion);
      world.identify_all();
      ASSERT_EQ(world.phase(), SubjectPhase::Tracking) << set;
      world.step(180);
      ASSERT_EQ(world.correct_count(), world.marker_count()) << set;

      const Swapped swapped = exchange_all_neighbours(world, 0, 0.3);

      EXPECT_GT(swapped.pairs, 15) << set;
      EXPECT_LE(swapped.max_sets_wrong, 5) << set << ": " << swapped.worst;
      EXPECT_LE(swapped.max_sets_until_correct, 5) << set << ": " << swapped.worst;
    }
  }
}

TEST(LabelSwaps, OfTwoPeopleWhoShakeHandsAreCorrectedWithinFiveSets) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    LabelWorld world;
    const auto motion = test::into_posture({{"RightUpArm", {0.0, 0.3, 1.5}}, {"LeftUpArm", {-1.2, 0.0, 0.0}}});
    world.add(set, motion, {-0.52, 0.18, 1.0});
    world.add(set, motion, {0.52, -0.18, 1.0}, 3.14159, 1.05);
    world.identify_all();
    world.step(LabelWorld::kTPoseSets);
    ASSERT_EQ(world.phase(0), SubjectPhase::Tracking) << set;
    ASSERT_EQ(world.phase(1), SubjectPhase::Tracking) << set;
    world.step(60);
    ASSERT_EQ(world.correct_count(), world.marker_count()) << set;

    const Swapped swapped = exchange_all_neighbours(world, 1, 0.3);

    EXPECT_GE(swapped.pairs, 1) << set;
    EXPECT_LE(swapped.max_sets_wrong, 5) << set << ": " << swapped.worst;
    EXPECT_LE(swapped.max_sets_until_correct, 5) << set << ": " << swapped.worst;
  }
}

TEST(LabelSwaps, OfBothLegsAreCorrectedWithinFiveSets) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.identify_all();
  world.step(180);
  auto& tracks = world.actor().tracks;

  for (const char* name : {"Thigh", "KneeOut", "Shin", "AnkleOut", "Heel", "ToeOut", "ToeTip"}) {
    const std::string bare = name;
    world.exchange(tracks[world.marker("L" + bare)], tracks[world.marker("R" + bare)]);
  }

  int wrong = 0;
  for (int i = 0; i < 12; ++i) {
    world.step();
    wrong += world.wrong_count() > 0 ? 1 : 0;
    if (i >= 5) {
      EXPECT_EQ(world.correct_count(), world.marker_count()) << i;
    }
  }
  EXPECT_LE(wrong, 5);
}

}  // namespace label_swaps_test
}  // namespace mocap::label
