#include "label/limb_hypothesis_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string_view>
#include <vector>

#include "label/label_world.h"

namespace mocap::label {
namespace {

using test::LabelWorld;
using test::markers_of;
using test::moving_later;

constexpr std::string_view kLeg = "LeftUpLeg LeftLowLeg LeftFoot";

std::vector<std::size_t> leg_of(LabelWorld& world) { return markers_of(world.one(), kLeg); }

// A person, told by all markers but those of a leg, which has moved; and the leg's markers as places.
struct ReadLimb : testing::Test {
  ReadLimb()
      : set(test::person("baseline41")),
        constraints(set),
        body(set, {}),
        truth(set, kinematics::PoseFit::Lengths::Fixed),
        limb(set, {}) {
    std::vector<kinematics::Observation> all;
    for (std::size_t m = 0; m < set.markers.size(); ++m)
      all.push_back({static_cast<int>(m), truth.marker_at(m), 0.004});
    EXPECT_TRUE(body.start(all, from_ns(1'000'000'000)));
    std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
    for (std::size_t b = 0; b < locals.size(); ++b) {
      if (set.skeleton.bones[b].name == "LeftUpLeg")
        locals[b].rotation = kinematics::from_rotation_vector({0.0, -0.7, 0.0});
      if (set.skeleton.bones[b].name == "LeftLowLeg")
        locals[b].rotation = kinematics::from_rotation_vector({0.0, 0.9, 0.0});
    }
    truth.set_locals(locals);
    body.predict(from_ns(1'008'333'333));
    std::vector<kinematics::Observation> others;
    limb.clear();
    for (const kinematics::Observation& one : all) {
      const auto m = static_cast<std::size_t>(one.marker);
      const auto bone = static_cast<std::size_t>(set.markers[m].bone);
      if (kLeg.find(set.skeleton.bones[bone].name) == std::string_view::npos) {
        others.push_back(one);
      } else {
        EXPECT_TRUE(limb.add_label(m));
      }
    }
    (void)body.update(others);
    for (std::size_t p = limb.label_count(); p-- > 0;)
      EXPECT_TRUE(limb.add_candidate({TrackId{100}, truth.marker_at(limb.marker(p)), 0.004, false}));
    for (std::size_t n = 0; n < limb.label_count(); ++n) {
      for (std::size_t p = 0; p < limb.candidate_count(); ++p) limb.allow(n, p, 0.0, 0.0);
    }
    limb.begin(constraints, body, others, std::vector<char>(set.skeleton.bones.size(), 0));
  }

  MarkerSet set;
  identify::DistanceConstraints constraints;
  pose::SkeletonTracker body;
  kinematics::PoseFit truth;
  LimbHypothesisSolver limb;
};

TEST_F(ReadLimb, ALegThatMovedIsFound) {
  const int judged = limb.advance(constraints, 1000);

  EXPECT_FALSE(limb.busy());
  EXPECT_GT(judged, static_cast<int>(DistanceConstraintMatcher::kMaxAssignments));  // its neighbours were exchanged
  ASSERT_NE(limb.found(), nullptr);
  for (std::size_t n = 0; n < limb.label_count(); ++n)
    EXPECT_EQ(limb.found()->candidate_of[n], static_cast<int>(limb.label_count() - 1 - n)) << n;
}

TEST_F(ReadLimb, WhatIsFoundDoesNotHangOnHowMuchIsDoneAtATime) {
  LimbHypothesisSolver slow = limb;
  const int judged = limb.advance(constraints, 1000);
  int calls = 0, sum = 0;
  for (; slow.busy() && calls < 1000; ++calls) {
    EXPECT_EQ(slow.found(), nullptr);
    sum += slow.advance(constraints, 1);
  }

  EXPECT_EQ(sum, judged);
  EXPECT_GE(calls, judged);
  ASSERT_TRUE(slow.found() != nullptr && limb.found() != nullptr);
  EXPECT_EQ(slow.found()->candidate_of, limb.found()->candidate_of);
  EXPECT_EQ(slow.found()->cost, limb.found()->cost);
}

TEST_F(ReadLimb, APlaceIsOfAllNamesThatGoodReadingsGiveIt) {
  (void)limb.advance(constraints, 1000);
  for (std::size_t n = 0; n < limb.label_count(); ++n) {
    const LimbHypothesisSolver::Probabilities probabilities =
        limb.association_probabilities(static_cast<int>(limb.label_count() - 1 - n));
    for (std::size_t other = 0; other < probabilities.size(); ++other)
      EXPECT_NEAR(probabilities[other], other == n ? 1.0 : 0.0, 1e-12) << n << ' ' << other;
  }
  const LimbHypothesisSolver::Probabilities nobodys =
      limb.association_probabilities(static_cast<int>(limb.candidate_count()));
  EXPECT_TRUE(std::ranges::all_of(nobodys, [](double share) { return share == 0.0; }));
}

TEST_F(ReadLimb, ALimbThatMayBeNowhereHasNoLikeliestPlaces) {
  (void)limb.advance(constraints, 1000);
  ASSERT_GE(limb.likeliest().candidate_of[0], 0);

  limb.clear();
  EXPECT_TRUE(limb.add_label(0));
  limb.begin(constraints, body, {}, std::vector<char>(set.skeleton.bones.size(), 0));

  EXPECT_EQ(limb.advance(constraints, 1000), 0);
  EXPECT_FALSE(limb.busy());
  EXPECT_EQ(limb.found(), nullptr);
  EXPECT_EQ(limb.likeliest().candidate_of[0], LimbHypothesisSolver::kUnassigned);
}

TEST_F(ReadLimb, StoppedItFindsNothing) {
  EXPECT_EQ(limb.advance(constraints, 3), 3);
  EXPECT_TRUE(limb.busy());

  limb.stop();

  EXPECT_FALSE(limb.busy());
  EXPECT_EQ(limb.advance(constraints, 1000), 0);
  EXPECT_EQ(limb.found(), nullptr);
}

// Two readings a set: a leg takes fifty sets and more.
struct SlowLimbs : testing::Test {
  SlowLimbs() {
    world.settings.limb_work = 2;
    world.add("baseline41", moving_later({{"LeftUpLeg", {0.0, -1.1, 0.0}}, {"LeftLowLeg", {0.0, 1.3, 0.0}}}));
    world.begin();
    world.step(110);
    leg = leg_of(world);
    for (const std::size_t m : leg) world.one().tracks[m].hidden = true;
    world.step(70);
  }

  LabelWorld world;
  std::vector<std::size_t> leg;
};

TEST_F(SlowLimbs, ALegIsNamedSomeSetsLater) {
  for (const std::size_t m : leg) world.bring_back(world.one().tracks[m]);
  world.step(2);
  EXPECT_LT(world.rights(), world.markers());
  for (int set = 0; set < 120; ++set) {
    world.step();
    EXPECT_EQ(world.wrongs(), 0) << set;
  }

  EXPECT_EQ(world.rights(), world.markers());
}

// What was read of tracks that ended meanwhile is nothing.
TEST_F(SlowLimbs, TracksThatEndWhileTheyAreReadLeaveNoWrongNames) {
  auto& tracks = world.one().tracks;
  for (const std::size_t m : leg) world.bring_back(tracks[m]);
  for (int round = 0; round < 10; ++round) {
    world.step(5);
    for (const std::size_t m : leg) world.bring_back(tracks[m]);
    EXPECT_EQ(world.wrongs(), 0) << round;
  }
  for (int set = 0; set < 200; ++set) {
    world.step();
    EXPECT_EQ(world.wrongs(), 0) << set;
  }
  EXPECT_EQ(world.rights(), world.markers());
}

bool a_track_bears_two_names(LabelWorld& world) {
  std::vector<std::uint32_t> borne;
  for (std::size_t m = 0; m < world.one().tracks.size(); ++m) {
    if (world.label(m).state != LabelState::Lost) borne.push_back(world.label(m).track.value);
  }
  std::sort(borne.begin(), borne.end());
  return std::adjacent_find(borne.begin(), borne.end()) != borne.end();
}

// A shin that moves while nobody sees it, every second.
test::Moves shin_of(unsigned seed) {
  return [seed](const std::string& bone, double t_s) -> Eigen::Quaterniond {
    if (bone != "LeftLowLeg" && bone != "LeftUpLeg") return Eigen::Quaterniond::Identity();
    const auto pose = [&](int second) {
      std::mt19937 random(1000 * seed + static_cast<unsigned>(second));
      std::uniform_real_distribution<double> any(0.0, 1.0);
      return bone == "LeftLowLeg" ? 1.5 * any(random) : -0.1 * any(random);
    };
    const int second = static_cast<int>(t_s);
    const double share = std::clamp((t_s - second - 0.4) / 0.2, 0.0, 1.0);
    return kinematics::from_rotation_vector({0.0, (1.0 - share) * pose(second) + share * pose(second + 1), 0.0});
  };
}

// While the shin is read, names of the thigh, and others beside it, go to other tracks, or end.
TEST(SlowLimbsAnyhow, NoTrackBearsTwoNames) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    LabelWorld world;
    world.settings.limb_work = 1 + static_cast<int>(seed % 3);
    world.add("baseline41", shin_of(seed));
    world.begin();
    auto& tracks = world.one().tracks;
    const std::vector<std::size_t> shin = markers_of(world.one(), "LeftLowLeg LeftFoot");
    std::vector<std::size_t> near = markers_of(world.one(), "Hips LeftUpLeg");
    for (int round = 0; round < 6; ++round) {
      std::shuffle(near.begin(), near.end(), random);
      world.step(48);
      for (const std::size_t m : shin) tracks[m].hidden = true;
      world.step(24);
      for (const std::size_t m : shin) world.bring_back(tracks[m]);
      for (int set = 0; set < 48; ++set) {
        world.step();
        EXPECT_FALSE(a_track_bears_two_names(world)) << seed << ' ' << round << ' ' << set;
        if (set == 1 + round) world.exchange(tracks[near[0]], tracks[near[1]]);
        if (set == 1 + round) tracks[near[2]].coasts = true;
        if (set == 2 + round) world.exchange(tracks[near[3]], tracks[shin[seed % shin.size()]]);
        if (set == 30) world.bring_back(tracks[near[2]]);
      }
    }
  }
}

}  // namespace
}  // namespace mocap::label
