#include <gtest/gtest.h>

#include "label/label_world.h"

namespace mocap::label {
namespace {

using test::LabelWorld;

struct Swapped {
  int pairs = 0;
  int most_sets_wrong = 0;      // of one name
  int most_sets_until_all = 0;  // until every name is right again
  std::string worst;
};

// Exchanges every pair of tracks less than `near_m` apart, one after the other, with time to mend between.
Swapped exchange_all(LabelWorld& world, std::size_t other, double near_m) {
  Swapped result;
  auto& one = world.one(0);
  auto& two = world.one(other);
  for (std::size_t a = 0; a < one.tracks.size(); ++a) {
    for (std::size_t b = other == 0 ? a + 1 : 0; b < two.tracks.size(); ++b) {
      if ((world.true_place(a, 0) - world.true_place(b, other)).norm() > near_m) continue;
      ++result.pairs;
      world.exchange(one.tracks[a], two.tracks[b]);
      int wrong = 0;
      int until_all = 0;
      for (int i = 0; i < 12; ++i) {
        world.step();
        wrong += world.wrongs() > 0 ? 1 : 0;
        if (world.rights() < world.markers()) until_all = i + 1;
      }
      result.most_sets_wrong = std::max(result.most_sets_wrong, wrong);
      if (until_all > result.most_sets_until_all) {
        result.most_sets_until_all = until_all;
        result.worst = one.set.markers[a].name + " and " + two.set.markers[b].name;
      }
    }
  }
  return result;
}

TEST(LabelSwaps, EveryPairOfNeighboursThatExchangeTracksIsMendedWithinFiveSets) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    for (const auto& moves : {test::walking(), test::hands_and_feet_together()}) {
      LabelWorld world;
      world.add(set, moves);
      world.begin();
      ASSERT_EQ(world.phase(), SubjectPhase::Tracking) << set;
      world.step(180);
      ASSERT_EQ(world.rights(), world.markers()) << set;

      const Swapped swapped = exchange_all(world, 0, 0.3);

      EXPECT_GT(swapped.pairs, 15) << set;
      EXPECT_LE(swapped.most_sets_wrong, 5) << set << ": " << swapped.worst;
      EXPECT_LE(swapped.most_sets_until_all, 5) << set << ": " << swapped.worst;
    }
  }
}

TEST(LabelSwaps, NoNameMovesToTheOtherOfTwoPeopleWhoShakeHands) {
  for (const char* set : {"baseline41", "openmocap18"}) {
    LabelWorld world;
    const auto moves = test::into_posture({{"RightUpArm", {0.0, 0.3, 1.5}}, {"LeftUpArm", {-1.2, 0.0, 0.0}}});
    world.add(set, moves, {-0.52, 0.18, 1.0});
    world.add(set, moves, {0.52, -0.18, 1.0}, 3.14159, 1.05);
    world.begin();
    world.step(LabelWorld::kStill);
    ASSERT_EQ(world.phase(0), SubjectPhase::Tracking) << set;
    ASSERT_EQ(world.phase(1), SubjectPhase::Tracking) << set;
    world.step(60);
    ASSERT_EQ(world.rights(), world.markers()) << set;

    const Swapped swapped = exchange_all(world, 1, 0.3);

    EXPECT_GE(swapped.pairs, 1) << set;
    EXPECT_LE(swapped.most_sets_wrong, 5) << set << ": " << swapped.worst;
    EXPECT_LE(swapped.most_sets_until_all, 5) << set << ": " << swapped.worst;
  }
}

TEST(LabelSwaps, ALegThatExchangesAllItsTracksWithTheOtherIsMendedWithinFiveSets) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.begin();
  world.step(180);
  auto& tracks = world.one().tracks;

  for (const char* name : {"Thigh", "KneeOut", "Shin", "AnkleOut", "Heel", "ToeOut", "ToeTip"}) {
    const std::string bare = name;
    world.exchange(tracks[world.marker("L" + bare)], tracks[world.marker("R" + bare)]);
  }

  int wrong = 0;
  for (int i = 0; i < 12; ++i) {
    world.step();
    wrong += world.wrongs() > 0 ? 1 : 0;
    if (i >= 5) {
      EXPECT_EQ(world.rights(), world.markers()) << i;
    }
  }
  EXPECT_LE(wrong, 5);
}

}  // namespace
}  // namespace mocap::label
