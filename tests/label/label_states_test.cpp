#include <gtest/gtest.h>

#include "label/label_world.h"
#include "solve/tree_solver.h"

namespace mocap::label {
namespace {

using test::LabelWorld;

constexpr float kSure = 0.9F;

TEST(LabelStates, AMarkerIsMeasuredThenFilledThenLostWhenNobodySeesIt) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  const auto solver = solve::make_skeleton_solver({.fill_for_s = 0.5, .smoothing = {}}, world.subjects());
  Labels labels;
  const auto step = [&](int sets) {
    for (int i = 0; i < sets; ++i) {
      world.step();
      labels = world.labels();
      (void)solver->solve(labels, world.at());
    }
  };
  world.begin();
  step(120);
  const std::size_t knee = world.marker("LKneeOut");
  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Measured);

  world.one().tracks[knee].hidden = true;
  step(30);

  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Filled);
  EXPECT_LT(labels[0].markers[knee].confidence, kSure);
  // Thigh, hip and shin markers tell the knee: within the thickness of skin.
  EXPECT_LT((labels[0].markers[knee].position.v - world.true_place(knee)).norm(), 0.01);

  step(60);

  EXPECT_EQ(labels[0].markers[knee].state, LabelState::Lost);
  EXPECT_EQ(labels[0].markers[knee].confidence, 0.0F);
}

TEST(LabelStates, ANameIsSureAfterAWhileAndNotWhenItsTrackHasJumped) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.begin();
  world.step(60);
  const std::size_t in = world.marker("LWristIn");
  const std::size_t out = world.marker("LWristOut");
  for (std::size_t m = 0; m < world.one().tracks.size(); ++m) EXPECT_GT(world.label(m).confidence, kSure) << m;

  world.exchange(world.one().tracks[in], world.one().tracks[out]);
  world.step();

  EXPECT_LT(world.label(in).confidence, kSure);
  EXPECT_LT(world.label(out).confidence, kSure);
  EXPECT_GT(world.label(world.marker("HeadTop")).confidence, kSure);
}

TEST(LabelStates, ATrackThatComesBackFromCoastingBearsItsOldName) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.begin();
  world.step(120);
  const std::size_t out = world.marker("RWristOut");
  world.one().tracks[world.marker("RWristIn")].hidden = true;
  world.one().tracks[out].coasts = true;
  world.step(12);
  EXPECT_NE(world.label(out).state, LabelState::Measured);

  world.one().tracks[out].coasts = false;
  world.step(5);

  EXPECT_EQ(world.wrongs(), 0);
  EXPECT_TRUE(world.right(out));
}

TEST(LabelStates, ABodyThatItsTracksDoNotFitAnyMoreIsLetGo) {
  LabelWorld world;
  world.add("baseline41", test::walking());
  world.begin();
  world.step(120);
  auto& tracks = world.one().tracks;

  // Both legs' markers go elsewhere, each on its own.
  int away = 0;
  for (std::size_t m = world.marker("LThigh"); m < tracks.size(); ++m) {
    const std::string& name = world.one().set.markers[m].name;
    if (name.find("Shoulder") != std::string::npos || name.find("Arm") != std::string::npos) continue;
    if (name.find("Elbow") != std::string::npos || name.find("Wrist") != std::string::npos) continue;
    world.bring_back(tracks[m]);
    ++away;
    tracks[m].off = 0.25 * Eigen::Vector3d(std::sin(2.0 * away), std::cos(3.0 * away), std::sin(5.0 * away + 1.0));
  }
  bool let_go = false;
  for (int i = 0; i < 180 && !let_go; ++i) {
    world.step();
    let_go = world.phase() != SubjectPhase::Tracking;
  }

  EXPECT_TRUE(let_go);
}

}  // namespace
}  // namespace mocap::label
