#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string_view>
#include <vector>

#include "label/label_world.h"
#include "solve/tree_solver.h"

namespace mocap::label {
namespace ambiguous_observations_test {

using test::LabelWorld;
using test::markers_of;
using test::moving_later;

// A forearm and hand that move while they are hidden; then one of their markers is detected again. Two solvers: one
// gets the ambiguous observations, the other (blind) does not.
struct AmbiguousObservations : testing::Test {
  AmbiguousObservations() {
    world.add("baseline41", moving_later({{"LeftUpArm", {0.0, 0.0, -0.4}}, {"LeftLowArm", {0.0, 0.3, -0.7}}}));
    world.identify_all();
    solver = solve::make_skeleton_solver({}, world.subjects());
    blind_solver = solve::make_skeleton_solver({}, world.subjects());
  }

  void step(int sets) {
    for (int i = 0; i < sets; ++i) {
      world.step();
      const Labels& labels = world.labels();
      hand_error_m = off_m(solver->solve(labels, world.at(), {}, world.ambiguous_observations()).poses);
      blind_hand_error_m = off_m(blind_solver->solve(labels, world.at()).poses);
    }
  }
  double off_m(const Poses& poses) {
    const auto& bones = world.actor().set.skeleton.bones;
    std::size_t hand = 0;
    while (bones[hand].name != "LeftHand") ++hand;
    return (poses[0].bones[hand].world_from_bone.position - world.actor().truth->world()[hand].position).norm();
  }
  // Returns whether the marker is an ambiguous observation then.
  bool lone_marker_reappears() {
    step(110);
    hide("LeftLowArm LeftHand");
    step(70);
    world.reappear(world.actor().tracks[world.marker("LWristOut")]);
    step(20);
    return !world.ambiguous_observations().empty();
  }
  void hide(std::string_view bones) {
    for (const std::size_t m : markers_of(world.actor(), bones)) world.actor().tracks[m].hidden = true;
  }

  LabelWorld world;
  std::unique_ptr<SkeletonSolver> solver, blind_solver;
  double hand_error_m = 0.0, blind_hand_error_m = 0.0;
};

TEST_F(AmbiguousObservations, ConstrainTheLimbOfATrackThatMayBeEitherOfTwoMarkers) {
  step(110);
  hide("LeftLowArm LeftHand");
  step(70);
  EXPECT_TRUE(world.ambiguous_observations().empty());
  EXPECT_GT(blind_hand_error_m, 0.1);

  world.reappear(world.actor().tracks[world.marker("LWristOut")]);
  step(40);

  ASSERT_EQ(world.ambiguous_observations().size(), 1U);
  const AmbiguousObservation& one = world.ambiguous_observations()[0];
  EXPECT_EQ(one.label.subject, SubjectId{0});
  EXPECT_LT((one.position.v - world.true_position(one.label.marker)).norm(), 0.1);
  EXPECT_EQ(world.wrong_count(), 0);
  EXPECT_LT(hand_error_m, 0.5 * blind_hand_error_m);
}

TEST_F(AmbiguousObservations, EndWhenTheMarkerHasItsLabel) {
  ASSERT_TRUE(lone_marker_reappears());

  for (const std::size_t m : markers_of(world.actor(), "LeftLowArm LeftHand")) {
    if (world.actor().tracks[m].hidden) world.reappear(world.actor().tracks[m]);
  }
  for (int set = 0; set < 20; ++set) {
    step(1);
    for (const AmbiguousObservation& one : world.ambiguous_observations())
      EXPECT_NE(world.label(one.label.marker).state, LabelState::Measured) << set;
  }

  EXPECT_EQ(world.correct_count(), world.marker_count());
  EXPECT_TRUE(world.ambiguous_observations().empty());
}

// Some markers of a hand and forearm are detected. One of these hides while its neighbour on the bone appears, and the
// track continues on the neighbour. The label of the track must not change from set to set.
TEST(AmbiguousTracks, AreNotLabelledAndUnlabelledInTurns) {
  const std::vector<const char*> arm{"LHandIn", "LHandOut", "LWristIn", "LWristOut", "LUArmHigh", "LElbowOut"};
  for (unsigned seed = 0; seed < 24; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> angle_rad(-1.0, 1.0);
    const auto angle = [&] { return angle_rad(random); };
    LabelWorld world;
    world.add("baseline41", moving_later({{"LeftUpArm", {angle(), angle(), angle()}},
                                          {"LeftLowArm", {angle(), 0.0, -1.0 + angle()}},
                                          {"LeftHand", {angle(), angle(), 0.0}}}));
    world.identify_all();
    world.step(95);
    auto& tracks = world.actor().tracks;
    const std::size_t hides = world.marker(arm[seed % 4]), comes = world.marker(arm[seed % 4 ^ 1]);
    for (const char* name : arm) tracks[world.marker(name)].hidden = world.marker(name) != hides && angle() < 0.6;
    tracks[comes].hidden = true;
    world.step(22);
    world.exchange(tracks[comes], tracks[hides]);
    tracks[comes].hidden = false;
    tracks[hides].hidden = true;

    int changes = 0;
    bool was_labelled = true;
    for (int set = 0; set < 40; ++set) {
      world.step();
      const bool labelled = std::ranges::any_of(arm, [&](const char* name) {
        const LabelledMarker& label = world.label(world.marker(name));
        return label.state == LabelState::Measured && label.track == tracks[comes].id;
      });
      changes += labelled != was_labelled ? 1 : 0;
      was_labelled = labelled;
      EXPECT_EQ(world.wrong_count(), 0) << seed << " set " << set;
    }
    EXPECT_LE(changes, 2) << seed;
  }
}

TEST_F(AmbiguousObservations, HaveTheSpreadOfTheCandidateMarkers) {
  ASSERT_TRUE(lone_marker_reappears());

  const AmbiguousObservation& one = world.ambiguous_observations()[0];

  EXPECT_GT(one.sigma_m, 0.005);
  EXPECT_LT(one.sigma_m, 0.1);
}

// A lone marker of a whole arm may be at the shoulder or on the hand.
TEST_F(AmbiguousObservations, OfAWholeArmHaveASpreadThatCoversTheError) {
  step(110);
  hide("LeftUpArm LeftLowArm LeftHand");
  step(70);

  world.reappear(world.actor().tracks[world.marker("LElbowOut")]);
  for (int set = 0; set < 20; ++set) {
    step(1);
    for (const AmbiguousObservation& one : world.ambiguous_observations()) {
      const double off_m = (one.position.v - world.true_position(one.label.marker)).norm();
      EXPECT_GT(one.sigma_m, 0.05) << set;
      EXPECT_LT(off_m, 3.0 * one.sigma_m) << set;
    }
  }
  EXPECT_LT(hand_error_m, blind_hand_error_m);
}

TEST_F(AmbiguousObservations, AreNotUsedBesideABearingOnlyObservation) {
  step(110);
  hide("LeftLowArm LeftHand");
  const auto label_of = [&](const char* marker) {
    return Label{SubjectId{0}, static_cast<std::uint32_t>(world.marker(marker))};
  };
  const WorldPoint eye{{4.0, 1.0, 2.5}};
  for (const bool with_ray : {true, false}) {
    for (int set = 0; set < 8; ++set) {
      world.step();
      const Eigen::Vector3d to = world.true_position(world.marker("LHandOut")) - eye.v;
      std::vector<LabelledBearing> rays;
      if (with_ray) rays.push_back({label_of("LHandOut"), CameraId{0}, eye, to.normalized(), 2e-4});
      const Eigen::Vector3d aside(0.0, 0.0, set < 4 ? 0.0 : 0.06);  // the ray is accepted after some sets
      const std::vector<AmbiguousObservation> ambiguous_observations{
          {label_of("LWristOut"), {world.true_position(world.marker("LWristOut")) + aside}}};
      const Labels& labels = world.labels();
      hand_error_m = off_m(solver->solve(labels, world.at(), rays, ambiguous_observations).poses);
      blind_hand_error_m = off_m(blind_solver->solve(labels, world.at(), rays).poses);
    }
    EXPECT_EQ(hand_error_m - blind_hand_error_m < 0.01, with_ray) << hand_error_m << ' ' << blind_hand_error_m;
  }
}

TEST_F(AmbiguousObservations, EndWithTheirTrack) {
  ASSERT_TRUE(lone_marker_reappears());

  hide("LeftLowArm LeftHand");
  step(1);

  EXPECT_TRUE(world.ambiguous_observations().empty());
}

// The arm moves all the time, and half of its markers are hidden, each for half a second.
TEST(AmbiguousTracks, OfHiddenHandsAreSeldomLabelledWrongly) {
  int wrong_count = 0, correct_count = 0, detected = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> phase_rad(0.0, 6.28);
    std::vector<double> phases(9);
    for (double& phase : phases) phase = phase_rad(random);
    LabelWorld world;
    world.add("baseline41", [phases](const std::string& bone, double t_s) -> Eigen::Quaterniond {
      const double share = std::min(1.0, t_s);
      const auto swing = [&](std::size_t i, double most_rad) {
        return share * most_rad * std::sin(5.0 * t_s + phases[i]);
      };
      if (bone == "LeftUpArm")
        return kinematics::from_rotation_vector({swing(0, 0.8) - share, swing(1, 0.6), swing(2, 0.6)});
      if (bone == "LeftLowArm")
        return kinematics::from_rotation_vector({swing(3, 0.9), 0.0, swing(4, 0.6) - 0.9 * share});
      if (bone == "LeftHand") return kinematics::from_rotation_vector({swing(5, 0.5), swing(6, 0.4), swing(7, 0.4)});
      return Eigen::Quaterniond::Identity();
    });
    world.identify_all();
    world.step(150);
    const auto arm = markers_of(world.actor(), "LeftUpArm LeftLowArm LeftHand");
    std::uniform_int_distribution<int> when(0, 59);
    std::bernoulli_distribution hides(0.55);
    std::vector<int> hidden_from(arm.size());
    for (int& set : hidden_from) set = when(random);
    for (int set = 0; set < 900; ++set) {
      for (std::size_t i = 0; i < arm.size(); ++i) {
        if (set % 60 != hidden_from[i]) continue;
        auto& track = world.actor().tracks[arm[i]];
        const bool was = track.hidden, now = hides(random);
        if (was && !now) world.reappear(track);
        track.hidden = now;
      }
      world.step();
      wrong_count += world.wrong_count();
      for (const std::size_t m : arm) {
        detected += world.actor().tracks[m].hidden ? 0 : 1;
        correct_count += world.is_correct(m) ? 1 : 0;
      }
    }
  }
  EXPECT_LT(wrong_count, 100);
  EXPECT_GT(correct_count, 0.7 * detected);
}

}  // namespace ambiguous_observations_test
}  // namespace mocap::label
