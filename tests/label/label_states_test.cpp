#include <gtest/gtest.h>

#include <cstdint>

#include "label/label_world.h"
#include "solve/tree_solver.h"

namespace mocap::label {
namespace label_states_test {

using test::LabelWorld;

constexpr float kHighConfidence = 0.9F;

TEST(LabelStates, GoFromMeasuredToFilledToLostWhileAMarkerIsHidden) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  const auto solver = solve::make_skeleton_solver({.fill_for_s = 0.5, .smoothing = {}}, world.subjects());
  Labels labels;
  const auto step = [&](int sets) {
    for (int i = 0; i < sets; ++i) {
      world.step();
      labels = solver->solve(world.labels(), world.at()).labels;
    }
  };
  world.identify_all();
  step(120);
  const std::size_t knee = world.marker("LKneeOut");
  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Measured);

  world.actor().tracks[knee].hidden = true;
  step(30);

  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Filled);
  EXPECT_LT(labels[0].markers[knee].confidence, kHighConfidence);
  // Markers of thigh, hip and shin determine the knee to within 10 mm, the thickness of skin.
  EXPECT_LT((labels[0].markers[knee].position.v - world.true_position(knee)).norm(), 0.01);

  step(60);

  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Lost);
  EXPECT_EQ(labels[0].markers[knee].confidence, 0.0F);
}

TEST(LabelStates, HaveHighConfidenceUntilTheTrackJumps) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.identify_all();
  world.step(60);
  const std::size_t in = world.marker("LWristIn");
  const std::size_t out = world.marker("LWristOut");
  for (std::size_t m = 0; m < world.actor().tracks.size(); ++m)
    EXPECT_GT(world.label(m).confidence, kHighConfidence) << m;

  world.exchange(world.actor().tracks[in], world.actor().tracks[out]);
  world.step();

  EXPECT_LT(world.label(in).confidence, kHighConfidence);
  EXPECT_LT(world.label(out).confidence, kHighConfidence);
  EXPECT_GT(world.label(world.marker("HeadTop")).confidence, kHighConfidence);
}

TEST(LabelStates, ReturnToATrackThatIsDetectedAgainAfterCoasting) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.identify_all();
  world.step(120);
  const std::size_t out = world.marker("RWristOut");
  world.actor().tracks[world.marker("RWristIn")].hidden = true;
  world.actor().tracks[out].coasts = true;
  world.step(12);
  EXPECT_NE(world.label(out).state, LabelState::Measured);

  world.actor().tracks[out].coasts = false;
  world.step(5);

  EXPECT_EQ(world.wrong_count(), 0);
  EXPECT_TRUE(world.is_correct(out));
}

TEST(LabelStates, EndWhenTheTracksNoLongerFitTheBody) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.identify_all();
  world.step(120);
  auto& tracks = world.actor().tracks;

  // The markers of both legs move away, each in its own direction.
  int away = 0;
  for (std::size_t m = world.marker("LThigh"); m < tracks.size(); ++m) {
    const std::string& name = world.actor().set.markers[m].name;
    if (name.find("Shoulder") != std::string::npos || name.find("Arm") != std::string::npos) continue;
    if (name.find("Elbow") != std::string::npos || name.find("Wrist") != std::string::npos) continue;
    world.reappear(tracks[m]);
    ++away;
    tracks[m].off = 0.25 * Eigen::Vector3d(std::sin(2.0 * away), std::cos(3.0 * away), std::sin(5.0 * away + 1.0));
  }
  bool lost = false;
  for (int i = 0; i < 180 && !lost; ++i) {
    world.step();
    lost = world.phase() != SubjectPhase::Tracking;
  }

  EXPECT_TRUE(lost);
}

// The phase is Tracking in each set: a fresh labeller finds the fitted body in any pose, and its first search for a
// calibration pose, which is due at once, is for a T-pose.
TEST(LabelStates, CountAnIdentificationInTheSetOfAReset) {
  LabelWorld world;
  world.add("baseline41", test::into_posture({}));
  world.identify_all();
  world.change_subjects({{"actor", world.actor().set, true}}, {.subjects = {SubjectId{}}, .cameras = {}});
  world.step(90);
  ASSERT_EQ(world.phase(), SubjectPhase::Tracking);
  const std::uint32_t identifications = world.labels()[0].identifications;
  world.step(10);
  ASSERT_EQ(world.labels()[0].identifications, identifications);

  world.labeller().reset(SubjectId{0});
  world.step();

  EXPECT_EQ(world.phase(), SubjectPhase::Tracking);
  EXPECT_EQ(world.labels()[0].identifications, identifications + 1);
}

}  // namespace label_states_test
}  // namespace mocap::label
