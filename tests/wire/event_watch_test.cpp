#include "wire/event_watch.h"

#include <gtest/gtest.h>

#include <memory>

namespace mocap::wire {
namespace event_watch_test {

constexpr Timestamp kNow = from_ns(5'000'000'000);

void update(EventWatch& watch, SubjectPhase phase, std::uint32_t subject = 0) {
  const auto snapshot = std::make_unique<Snapshot>();  // too large for the stack of a sanitizer run
  snapshot->instants.exposed_at = kNow;
  snapshot->labels.push_back({SubjectId{subject}, phase, {}});
  watch.update(*snapshot);
}

Description two_subjects(std::uint32_t version) {
  Description description;
  description.version = version;
  description.cameras.resize(2);
  description.subjects.resize(2);
  description.subjects[0].name = "anna";
  description.subjects[1].name = "bo\xFF";
  return description;
}

Health health_of(CameraPhase west, CameraPhase east) {
  Health health;
  health.at = kNow;
  health.cameras.resize(2);
  health.cameras[0].name = "west";
  health.cameras[0].phase = west;
  health.cameras[1].name = "east";
  health.cameras[1].phase = east;
  health.cameras[1].last_error = "cable pulled";
  return health;
}

TEST(EventWatch, ReportsASubjectOnceWhenFoundAndOnceWhenLost) {
  EventWatch watch;
  watch.update(two_subjects(3), kNow);

  for (const SubjectPhase phase : {SubjectPhase::Searching, SubjectPhase::Tracking, SubjectPhase::Tracking,
                                   SubjectPhase::Lost, SubjectPhase::Searching}) {
    update(watch, phase, 1);
  }

  ASSERT_EQ(watch.unsent().size(), 2U);
  const v1::Event& found = watch.unsent()[0];
  EXPECT_EQ(found.kind(), v1::EVENT_KIND_SUBJECT_FOUND);
  EXPECT_EQ(found.subject(), 1U);
  EXPECT_EQ(found.message(), "bo?") << "not UTF-8";
  EXPECT_EQ(found.at_ns(), to_ns(kNow));
  EXPECT_EQ(found.description_version(), 3U);
  EXPECT_FALSE(found.has_camera());
  EXPECT_EQ(watch.unsent()[1].kind(), v1::EVENT_KIND_SUBJECT_LOST);
  EXPECT_EQ(watch.unsent()[1].sequence(), found.sequence() + 1);
}

TEST(EventWatch, ReportsEveryDescriptionAfterTheFirst) {
  EventWatch watch;

  watch.update(two_subjects(1), kNow);
  EXPECT_TRUE(watch.unsent().empty());
  watch.update(two_subjects(2), kNow);

  ASSERT_EQ(watch.unsent().size(), 1U);
  EXPECT_EQ(watch.unsent()[0].kind(), v1::EVENT_KIND_DESCRIPTION_CHANGED);
  EXPECT_EQ(watch.unsent()[0].description_version(), 2U);
}

TEST(EventWatch, ReportsALostCameraWithTheReasonAndItsReturn) {
  EventWatch watch;
  watch.update(two_subjects(1), kNow);

  watch.update(health_of(CameraPhase::Streaming, CameraPhase::Silent));
  watch.update(health_of(CameraPhase::Streaming, CameraPhase::Reopening));
  watch.update(health_of(CameraPhase::Streaming, CameraPhase::Starting));
  watch.update(health_of(CameraPhase::Streaming, CameraPhase::Streaming));

  ASSERT_EQ(watch.unsent().size(), 2U);
  const v1::Event& lost = watch.unsent()[0];
  EXPECT_EQ(lost.kind(), v1::EVENT_KIND_CAMERA_LOST);
  EXPECT_EQ(lost.camera(), 1U);
  EXPECT_FALSE(lost.has_subject());
  EXPECT_EQ(lost.message(), "east: cable pulled");
  EXPECT_EQ(watch.unsent()[1].kind(), v1::EVENT_KIND_CAMERA_BACK);
  EXPECT_EQ(watch.unsent()[1].message(), "east");
}

TEST(EventWatch, ReportsStartAndEndOfATakeOnce) {
  EventWatch watch;
  watch.update(two_subjects(1), kNow);
  Health health = health_of(CameraPhase::Streaming, CameraPhase::Streaming);
  const auto look = [&](TakeState state, std::uint64_t takes) {
    health.take.state = state;
    health.take.takes = takes;
    health.take.name = bounded_text<255>("walk_" + std::to_string(takes));
    for (int i = 0; i < 2; ++i) watch.update(health);
  };
  health.take.message = bounded_text<511>("the disk is full");
  health.take.quality = TakeQuality::Good;

  look(TakeState::None, 0);
  look(TakeState::Recording, 1);
  look(TakeState::Ended, 1);
  look(TakeState::Failed, 2);  // began and ended between two looks

  ASSERT_EQ(watch.unsent().size(), 4U);
  const std::pair<v1::EventKind, std::string> expected[] = {{v1::EVENT_KIND_TAKE_STARTED, "walk_1"},
                                                            {v1::EVENT_KIND_TAKE_ENDED, "walk_1: good"},
                                                            {v1::EVENT_KIND_TAKE_STARTED, "walk_2"},
                                                            {v1::EVENT_KIND_TAKE_FAILED, "walk_2: the disk is full"}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(watch.unsent()[i].kind(), expected[i].first);
    EXPECT_EQ(watch.unsent()[i].message(), expected[i].second);
  }
}

// The feed was opened again.
TEST(EventWatch, DoesNotReportATakeThatEndedBeforeTheFirstLook) {
  EventWatch watch;
  Health health = health_of(CameraPhase::Streaming, CameraPhase::Streaming);
  health.take.state = TakeState::Ended;
  health.take.takes = 3;

  for (int i = 0; i < 2; ++i) watch.update(health);
  EXPECT_TRUE(watch.unsent().empty());
  health.take.takes = 4;
  watch.update(health);

  EXPECT_EQ(watch.unsent().size(), 2U) << "start and end of the next one";
}

TEST(EventWatch, FollowsCamerasByTheirNames) {
  Description description;
  description.version = 1;
  description.cameras.resize(3);
  const char* const names[] = {"west", "east", "south"};
  for (std::size_t i = 0; i < 3; ++i) description.cameras[i].name = names[i];
  Health health = health_of(CameraPhase::Streaming, CameraPhase::Silent);
  health.cameras.resize(3);
  health.cameras[2].name = "south";
  health.cameras[2].phase = CameraPhase::Streaming;
  EventWatch watch;
  watch.update(description, kNow);
  watch.update(health);

  description.version = 2;  // east is taken out
  description.cameras.erase(description.cameras.begin() + 1);
  health.cameras.erase(health.cameras.begin() + 1);
  watch.update(description, kNow);
  watch.update(health);

  ASSERT_EQ(watch.unsent().size(), 2U);
  EXPECT_EQ(watch.unsent()[0].kind(), v1::EVENT_KIND_CAMERA_LOST);
  EXPECT_EQ(watch.unsent()[1].kind(), v1::EVENT_KIND_DESCRIPTION_CHANGED);
}

TEST(EventWatch, DoesNotReportACameraThatAnOperatorStopped) {
  EventWatch watch;

  watch.update(health_of(CameraPhase::Stopped, CameraPhase::Ended));

  EXPECT_TRUE(watch.unsent().empty());
}

TEST(EventWatch, RetainsTheNewest256EventsIfNoneIsSent) {
  EventWatch watch;

  for (int i = 0; i < 300; ++i) update(watch, i % 2 == 0 ? SubjectPhase::Tracking : SubjectPhase::Lost);

  ASSERT_EQ(watch.unsent().size(), 256U);
  EXPECT_EQ(watch.unsent().front().sequence(), 300U - 256U);
  EXPECT_EQ(watch.unsent().back().sequence(), 299U);
  watch.remove_oldest();
  EXPECT_EQ(watch.unsent().front().sequence(), 300U - 255U);
}

TEST(EventWatch, IgnoresASubjectBeyondTheBound) {
  EventWatch watch;

  update(watch, SubjectPhase::Tracking, kMaxSubjects);

  EXPECT_TRUE(watch.unsent().empty());
}

}  // namespace event_watch_test
}  // namespace mocap::wire
