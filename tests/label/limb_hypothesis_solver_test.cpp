#include "label/limb_hypothesis_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string_view>
#include <vector>

#include "label/label_world.h"

namespace mocap::label {
namespace limb_hypothesis_solver_test {

using test::LabelWorld;
using test::markers_of;
using test::moving_later;

constexpr std::string_view kLeg = "LeftUpLeg LeftLowLeg LeftFoot";

std::vector<std::size_t> leg_of(LabelWorld& world) { return markers_of(world.actor(), kLeg); }

// A person whose markers are observed except those of a leg, which has moved. The candidates are the markers of the
// leg, in reverse order.
struct LegHypotheses : testing::Test {
  LegHypotheses()
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

TEST_F(LegHypotheses, FindALegThatMoved) {
  const int evaluated = limb.advance(constraints, 1000);

  EXPECT_FALSE(limb.busy());
  EXPECT_GT(evaluated,
            static_cast<int>(DistanceConstraintMatcher::kMaxAssignments));  // swaps of neighbours were evaluated
  ASSERT_NE(limb.found(), nullptr);
  for (std::size_t n = 0; n < limb.label_count(); ++n)
    EXPECT_EQ(limb.found()->candidate_of[n], static_cast<int>(limb.label_count() - 1 - n)) << n;
}

TEST_F(LegHypotheses, DoNotDependOnTheWorkOfOneCall) {
  LimbHypothesisSolver slow = limb;
  const int evaluated = limb.advance(constraints, 1000);
  int calls = 0, sum = 0;
  for (; slow.busy() && calls < 1000; ++calls) {
    EXPECT_EQ(slow.found(), nullptr);
    sum += slow.advance(constraints, 1);
  }

  EXPECT_EQ(sum, evaluated);
  EXPECT_GE(calls, evaluated);
  ASSERT_TRUE(slow.found() != nullptr && limb.found() != nullptr);
  EXPECT_EQ(slow.found()->candidate_of, limb.found()->candidate_of);
  EXPECT_EQ(slow.found()->cost, limb.found()->cost);
}

TEST_F(LegHypotheses, GiveAssociationProbabilitiesOverTheBestHypotheses) {
  (void)limb.advance(constraints, 1000);
  for (std::size_t n = 0; n < limb.label_count(); ++n) {
    const LimbHypothesisSolver::Probabilities probabilities =
        limb.association_probabilities(static_cast<int>(limb.label_count() - 1 - n));
    for (std::size_t other = 0; other < probabilities.size(); ++other)
      EXPECT_NEAR(probabilities[other], other == n ? 1.0 : 0.0, 1e-12) << n << ' ' << other;
  }
  const LimbHypothesisSolver::Probabilities unused =
      limb.association_probabilities(static_cast<int>(limb.candidate_count()));
  EXPECT_TRUE(std::ranges::all_of(unused, [](double share) { return share == 0.0; }));
}

TEST_F(LegHypotheses, AssignNothingToALimbWithoutCandidates) {
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

TEST_F(LegHypotheses, FindNothingAfterStop) {
  EXPECT_EQ(limb.advance(constraints, 3), 3);
  EXPECT_TRUE(limb.busy());

  limb.stop();

  EXPECT_FALSE(limb.busy());
  EXPECT_EQ(limb.advance(constraints, 1000), 0);
  EXPECT_EQ(limb.found(), nullptr);
}

// Two hypotheses a set: the search for a leg takes more than fifty sets.
struct LimbSearchOverManySets : testing::Test {
  LimbSearchOverManySets() {
    world.settings.limb_work = 2;
    world.add("baseline41", moving_later({{"LeftUpLeg", {0.0, -1.1, 0.0}}, {"LeftLowLeg", {0.0, 1.3, 0.0}}}));
    world.identify_all();
    world.step(110);
    leg = leg_of(world);
    for (const std::size_t m : leg) world.actor().tracks[m].hidden = true;
    world.step(70);
  }

  LabelWorld world;
  std::vector<std::size_t> leg;
};

TEST_F(LimbSearchOverManySets, LabelsALegSomeSetsLater) {
  for (const std::size_t m : leg) world.reappear(world.actor().tracks[m]);
  world.step(2);
  EXPECT_LT(world.correct_count(), world.marker_count());
  for (int set = 0; set < 120; ++set) {
    world.step();
    EXPECT_EQ(world.wrong_count(), 0) << set;
  }

  EXPECT_EQ(world.correct_count(), world.marker_count());
}

// A result on tracks that ended during the search must not be applied.
TEST_F(LimbSearchOverManySets, LeavesNoWrongLabelsWhenTracksEnd) {
  auto& tracks = world.actor().tracks;
  for (const std::size_t m : leg) world.reappear(tracks[m]);
  for (int round = 0; round < 10; ++round) {
    world.step(5);
    for (const std::size_t m : leg) world.reappear(tracks[m]);
    EXPECT_EQ(world.wrong_count(), 0) << round;
  }
  for (int set = 0; set < 200; ++set) {
    world.step();
    EXPECT_EQ(world.wrong_count(), 0) << set;
  }
  EXPECT_EQ(world.correct_count(), world.marker_count());
}

bool a_track_has_two_labels(LabelWorld& world) {
  std::vector<std::uint32_t> tracks_with_label;
  for (std::size_t m = 0; m < world.actor().tracks.size(); ++m) {
    if (world.label(m).state != LabelState::Lost) tracks_with_label.push_back(world.label(m).track.value);
  }
  std::sort(tracks_with_label.begin(), tracks_with_label.end());
  return std::adjacent_find(tracks_with_label.begin(), tracks_with_label.end()) != tracks_with_label.end();
}

// A shin that moves every second, while a test hides it.
test::Motion shin_of(unsigned seed) {
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

// During the search for the shin, labels of the thigh and hips change their tracks, or their tracks end.
TEST(LimbSearch, GivesNoTrackTwoLabels) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    LabelWorld world;
    world.settings.limb_work = 1 + static_cast<int>(seed % 3);
    world.add("baseline41", shin_of(seed));
    world.identify_all();
    auto& tracks = world.actor().tracks;
    const std::vector<std::size_t> shin = markers_of(world.actor(), "LeftLowLeg LeftFoot");
    std::vector<std::size_t> near = markers_of(world.actor(), "Hips LeftUpLeg");
    for (int round = 0; round < 6; ++round) {
      std::shuffle(near.begin(), near.end(), random);
      world.step(48);
      for (const std::size_t m : shin) tracks[m].hidden = true;
      world.step(24);
      for (const std::size_t m : shin) world.reappear(tracks[m]);
      for (int set = 0; set < 48; ++set) {
        world.step();
        EXPECT_FALSE(a_track_has_two_labels(world)) << seed << ' ' << round << ' ' << set;
        if (set == 1 + round) world.exchange(tracks[near[0]], tracks[near[1]]);
        if (set == 1 + round) tracks[near[2]].coasts = true;
        if (set == 2 + round) world.exchange(tracks[near[3]], tracks[shin[seed % shin.size()]]);
        if (set == 30) world.reappear(tracks[near[2]]);
      }
    }
  }
}

}  // namespace limb_hypothesis_solver_test
}  // namespace mocap::label
