#include "runtime/publish_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "runtime/control/control_channel.h"

namespace mocap::runtime {
namespace publish_worker_test {

using testing::ElementsAre;

/// Records the messages in the order of the calls.
class RecordingPublisher : public Publisher {
 public:
  struct Calls {
    std::vector<std::string> messages;
    std::vector<Description> descriptions;
    std::vector<Health> reports;
    bool fails = false;  // every snapshot
  };

  explicit RecordingPublisher(Calls& calls) : calls_(calls) {}
  Status describe(const Description& description) override {
    calls_.messages.push_back("description " + std::to_string(description.version));
    calls_.descriptions.push_back(description);
    return {};
  }
  Status publish(Snapshot& snapshot) override {
    if (calls_.fails) return Error{ErrorCode::Io, "no space"};
    calls_.messages.push_back("snapshot " + std::to_string(snapshot.number));
    return {};
  }
  Status report(const Health& health) override {
    calls_.reports.push_back(health);
    return {};
  }

 private:
  Calls& calls_;
};

/// The queues around a publish worker. The worker runs in the test's thread, on snapshots that are already in the
/// queue, until there are no more.
struct Queues {
  WakeSignal wake;
  CameraChannel camera{8, wake};
  StreamCounters stream;
  SnapshotChannel snapshots{8};
  FusionCounters fusion;
  ControlChannel control;
  SearchChannel search;
  PublishCounters counters;
  RecordingPublisher::Calls calls;

  Queues() { description.cameras.emplace_back().name = "north"; }

  void push(std::uint64_t number, std::uint32_t description_version = 1, SubjectPhase phase = SubjectPhase::Tracking) {
    const auto snapshot = std::make_unique<Snapshot>();
    snapshot->number = number;
    snapshot->description_version = description_version;
    snapshot->labels.push_back({SubjectId{0}, phase, {}});
    ASSERT_TRUE(snapshots.snapshots.try_push(*snapshot));
  }

  // One bone and one marker; `x_m`: the offset of the marker.
  void push_fit(std::uint32_t version, double x_m) {
    SubjectFit fit;
    fit.subject = SubjectId{0};
    fit.description_version = version;
    fit.rest_offsets_m.push_back({0.0, 0.0, 0.9});
    fit.marker_offsets_m.push_back({x_m, 0.0, 0.0});
    ASSERT_TRUE(snapshots.fits.try_push(fit));
  }

  void run(const PublishWorkerSettings& settings) {
    snapshots.ended = true;
    PublishWorker worker(std::make_unique<RecordingPublisher>(calls), description, settings,
                         {&snapshots, {&camera}, {&stream}, &fusion, &control, {}, &search}, counters);
    worker.run();
  }

  Description description;
};

PublishWorkerSettings every_snapshot() {
  PublishWorkerSettings settings;
  settings.every_snapshot = true;
  return settings;
}

TEST(PublishWorker, SendsTheDescriptionAndThenEverySnapshotInOrder) {
  Queues queues;
  for (const std::uint64_t number : {4, 5, 7}) queues.push(number);

  queues.run(every_snapshot());

  EXPECT_THAT(queues.calls.messages, ElementsAre("description 1", "snapshot 4", "snapshot 5", "snapshot 7"));
  EXPECT_EQ(queues.counters.sent.read(), 3U);
  EXPECT_EQ(queues.counters.passed_over.read(), 0U);
}

TEST(PublishWorker, SendsTheNewestSnapshotOnlyIfLate) {
  Queues queues;
  for (const std::uint64_t number : {4, 5, 7}) queues.push(number);

  queues.run({});

  EXPECT_THAT(queues.calls.messages, ElementsAre("description 1", "snapshot 7"));
  EXPECT_EQ(queues.counters.sent.read(), 1U);
  EXPECT_EQ(queues.counters.passed_over.read(), 2U);
}

TEST(PublishWorker, DescribesAFitBeforeTheFirstSnapshotThatUsesIt) {
  Queues queues;
  Subject& anna = queues.description.subjects.emplace_back();
  anna.marker_set.skeleton.bones.resize(1);
  anna.marker_set.markers.resize(1);
  queues.push_fit(2, 0.1);
  queues.push(1, 1);
  queues.push(2, 2);

  queues.run(every_snapshot());

  EXPECT_THAT(queues.calls.messages, ElementsAre("description 1", "snapshot 1", "description 2", "snapshot 2"));
  const MarkerSet& fitted = queues.calls.descriptions.back().subjects[0].marker_set;
  EXPECT_EQ(fitted.skeleton.bones[0].rest_offset_m.z(), 0.9);
  EXPECT_EQ(fitted.markers[0].offset_m.x(), 0.1);
  Description to_control;
  ASSERT_TRUE(queues.control.descriptions.try_pop(to_control));
  EXPECT_EQ(to_control.version, 2U);
}

TEST(PublishWorker, DescribesNoFitOfALaterSnapshot) {
  Queues queues;
  Subject& anna = queues.description.subjects.emplace_back();
  anna.marker_set.skeleton.bones.resize(1);
  anna.marker_set.markers.resize(1);
  for (const std::uint32_t version : {2, 3}) queues.push_fit(version, 0.1 * version);  // fusion is ahead
  for (const std::uint32_t version : {1, 2, 3}) queues.push(version, version);

  queues.run(every_snapshot());

  EXPECT_THAT(queues.calls.messages,
              ElementsAre("description 1", "snapshot 1", "description 2", "snapshot 2", "description 3", "snapshot 3"));
}

// The sentences in the last report, after one snapshot with the subject in `phase` and with a reason that it is
// missing.
std::vector<std::string> reasons_with(SubjectPhase phase, SearchCause cause) {
  Queues queues;
  SearchHealth reason;
  reason.subject = SubjectId{0};
  reason.cause = cause;
  reason.sentence = bounded_text<511>("anna is not found");
  EXPECT_TRUE(queues.search.reasons.try_push(reason));
  queues.push(1, 1, phase);
  PublishWorkerSettings settings = every_snapshot();
  settings.report_every = Duration{0};
  queues.run(settings);
  std::vector<std::string> sentences;
  for (const SearchHealth& search : queues.calls.reports.back().searches) {
    sentences.emplace_back(text_of(search.sentence));
  }
  return sentences;
}

TEST(PublishWorker, ReportsWhyASubjectIsNotFoundUnlessItIsTracked) {
  EXPECT_THAT(reasons_with(SubjectPhase::Searching, SearchCause::NoBlobs), ElementsAre("anna is not found"));
  EXPECT_THAT(reasons_with(SubjectPhase::Lost, SearchCause::NotStill), ElementsAre("anna is not found"));
  EXPECT_THAT(reasons_with(SubjectPhase::Tracking, SearchCause::NoBlobs), ElementsAre());
  EXPECT_THAT(reasons_with(SubjectPhase::Searching, SearchCause::None), ElementsAre());
}

TEST(PublishWorker, CountsSnapshotsThatCannotBeSentAndContinues) {
  Queues queues;
  queues.calls.fails = true;
  queues.push(1);
  queues.push(2);

  queues.run(every_snapshot());

  EXPECT_EQ(queues.counters.failed.read(), 2U);
  EXPECT_EQ(queues.counters.sent.read(), 0U);
}

TEST(PublishWorker, GivesTheControlThreadPhasesAndOneSnapshotPerRequest) {
  Queues queues;
  queues.control.snapshot_wanted = true;
  queues.push(1);
  queues.push(2);

  queues.run(every_snapshot());

  EXPECT_EQ(queues.control.phases[0], static_cast<int>(SubjectPhase::Tracking));
  EXPECT_FALSE(queues.control.snapshot_wanted);
  ASSERT_EQ(queues.control.snapshots.size(), 1U);
  EXPECT_EQ(queues.control.snapshots.front()->number, 1U);
}

TEST(PublishWorker, ReportsTheCountersOfAllThreads) {
  Queues queues;
  queues.push(1);
  queues.fusion.sets.add(10);
  queues.fusion.complete_sets.add(9);
  queues.camera.counters.frames.add(11);
  queues.camera.counters.reopened.add(2);
  queues.camera.rig.drifted.set(1.0);
  queues.camera.blob_use.add({40, 30});
  queues.stream.resent_packets = 5;
  CameraNote note;
  note.phase = CameraPhase::Reopening;
  for (const char c : std::string("cable")) note.error.push_back(c);
  ASSERT_TRUE(queues.camera.notes.try_push(note));
  PublishWorkerSettings settings;
  settings.report_every = Duration{1};

  queues.run(settings);

  ASSERT_FALSE(queues.calls.reports.empty());
  const Health& health = queues.calls.reports.back();
  EXPECT_EQ(health.sets, 10U);
  EXPECT_EQ(health.complete_sets, 9U);
  EXPECT_EQ(health.sent_snapshots, 1U);
  ASSERT_EQ(health.cameras.size(), 1U);
  const CameraHealth& north = health.cameras[0];
  EXPECT_EQ(north.name, "north");
  EXPECT_EQ(north.frames, 11U);
  EXPECT_EQ(north.reopened, 2U);
  EXPECT_EQ(north.resent_packets, 5U);
  EXPECT_TRUE(north.bumped);
  EXPECT_EQ(north.blob_use.blobs, 40U);
  EXPECT_EQ(north.blob_use.in_markers, 30U);
  EXPECT_EQ(queues.calls.reports.front().cameras[0].marker_share, 0.75) << "over the first period";
  EXPECT_EQ(north.phase, CameraPhase::Reopening);
  EXPECT_EQ(north.last_error, "cable");
}

}  // namespace publish_worker_test
}  // namespace mocap::runtime
