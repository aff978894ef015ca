#include <gtest/gtest.h>

#include "label/label_world.h"

namespace mocap::label {
namespace labeller_handover_test {

using test::LabelWorld;

// A walking person with all labels. Then a prop is added before it, so that its index changes.
struct ReloadedWorld : LabelWorld {
  ReloadedWorld() {
    add("baseline41", test::walking());
    identify_all();
    step(120);
  }
  void add_prop(const Handover& handover) {
    change_subjects({{"prop", test::person("rigid4")}, subjects().front()}, handover);
    actor().subject = 1;
  }
};

TEST(LabellerHandover, KeepsEveryLabelOfAWalkingPersonWhenAPropIsAdded) {
  ReloadedWorld world;
  ASSERT_EQ(world.correct_count(), world.marker_count());

  world.add_prop({.subjects = {SubjectId{}, SubjectId{0}}, .cameras = {}});

  for (int i = 0; i < 60; ++i) {
    world.step();
    ASSERT_EQ(world.phase(), SubjectPhase::Tracking) << i;
    ASSERT_EQ(world.correct_count(), world.marker_count()) << i;
  }
  EXPECT_EQ(world.labels()[0].phase, SubjectPhase::Searching);
}

TEST(LabellerHandover, SearchesForASubjectThatDoesNotContinue) {
  ReloadedWorld world;

  world.add_prop({.subjects = {SubjectId{}, SubjectId{}}, .cameras = {}});
  world.step();

  EXPECT_EQ(world.phase(), SubjectPhase::Searching);
  EXPECT_EQ(world.correct_count(), 0);
}

TEST(LabellerHandover, FindsAFittedBodyInAnyPoseIfTheCamerasMoved) {
  ReloadedWorld world;

  world.add_prop({.subjects = {SubjectId{}, SubjectId{0}}, .cameras = {}, .poses = false});
  world.step();
  EXPECT_EQ(world.phase(), SubjectPhase::Searching);
  world.step(240);

  EXPECT_EQ(world.phase(), SubjectPhase::Tracking);
  EXPECT_EQ(world.wrong_count(), 0);
}

}  // namespace labeller_handover_test
}  // namespace mocap::label
