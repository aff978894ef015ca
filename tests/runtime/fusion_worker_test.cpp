#include "runtime/fusion_worker.h"

#include <gtest/gtest.h>

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "fusion/idle_parts.h"
#include "runtime/control/control_channel.h"

namespace mocap::runtime {
namespace fusion_worker_test {

using std::chrono::milliseconds;

constexpr Timestamp kStart = from_ns(1'000'000'000);

/// Labels nothing. Records the orders, and requests a stop after each step, so that a live worker ends by itself.
class RecordingLabeller : public fusion::IdleLabeller {
 public:
  struct Calls {
    std::vector<std::string> orders;
    std::stop_source stop;
  };

  explicit RecordingLabeller(Calls& calls) : calls_(calls) {}
  const Labelling& label(const TrackedMarkers& tracked, const Predictions& predicted) override {
    calls_.stop.request_stop();
    return IdleLabeller::label(tracked, predicted);
  }
  void reset(SubjectId subject) override { calls_.orders.push_back("reset " + std::to_string(subject.value)); }
  void set_away(SubjectId subject, bool away) override {
    calls_.orders.push_back((away ? "away " : "present ") + std::to_string(subject.value));
  }

 private:
  Calls& calls_;
};

/// The queues around a fusion worker. The worker runs in the test's thread, on frames that are already in the queues.
struct Queues {
  explicit Queues(std::size_t publish_snapshots) : publish(publish_snapshots) {}

  WakeSignal wake;
  CameraChannel west{8, wake}, east{8, wake};
  SnapshotChannel publish;
  SnapshotChannel side{8};
  SnapshotChannel takes{8};
  SpscQueue<Belief> beliefs{1};
  ControlChannel control;
  TimecodeChannel timecode;
  FusionCounters counters;
  RecordingLabeller::Calls calls;

  void deliver(CameraChannel& channel, CameraId camera, std::vector<std::uint64_t> numbers, Delivery then) {
    for (const std::uint64_t number : numbers) {
      BlobFrame frame;
      frame.camera = camera;
      frame.number = number;
      frame.exposed_at = kStart + milliseconds(10 * static_cast<int>(number));
      frame.received_at = frame.exposed_at + milliseconds(1);
      frame.detected_at = frame.exposed_at + milliseconds(2);
      ASSERT_TRUE(channel.frames.try_push(frame));
    }
    channel.delivery = then;
  }

  void run(const FusionWorkerSettings& settings) {
    fusion::FusionParts parts = fusion::make_idle_parts();
    parts.labeller = std::make_unique<RecordingLabeller>(calls);
    FusionWorker worker({}, std::make_unique<fusion::Fusion>(std::move(parts), 2), settings,
                        {{&west, &east}, &publish, &side, &takes, &beliefs, &wake, &control, nullptr, &timecode},
                        counters);
    worker.run(settings.lossless ? std::stop_token{} : calls.stop.get_token());
  }

  /// The number of views of each snapshot in a queue.
  static std::vector<std::size_t> views_in(SnapshotChannel& channel) {
    std::vector<std::size_t> views;
    while (const Snapshot* oldest = channel.snapshots.front()) {
      views.push_back(oldest->views.size());
      channel.snapshots.pop();
    }
    return views;
  }
};

FusionWorkerSettings lossless() {
  FusionWorkerSettings settings;
  settings.lossless = true;
  return settings;
}

TEST(FusionWorker, FusesTheFramesOfAReplayIntoSetsAndEndsWithItsCameras) {
  Queues queues(8);
  queues.deliver(queues.west, CameraId{0}, {0, 1, 2, 3}, Delivery::Ended);
  queues.deliver(queues.east, CameraId{1}, {0, 2}, Delivery::Ended);

  queues.run(lossless());

  const std::vector<std::size_t> expected{2, 1, 2, 1};
  EXPECT_EQ(Queues::views_in(queues.publish), expected);
  EXPECT_EQ(Queues::views_in(queues.side), expected);
  EXPECT_EQ(queues.counters.sets.read(), 4U);
  EXPECT_EQ(queues.counters.complete_sets.read(), 2U);
  EXPECT_EQ(queues.counters.dropped_publish_full.read(), 0U);
  EXPECT_TRUE(queues.publish.ended);
  EXPECT_TRUE(queues.side.ended);
}

TEST(FusionWorker, OmitsTheTimesOfArrivalInAReplayOnly) {
  for (const bool replay : {true, false}) {
    Queues queues(8);
    queues.deliver(queues.west, CameraId{0}, {0}, replay ? Delivery::Ended : Delivery::Delivering);
    queues.deliver(queues.east, CameraId{1}, {0}, replay ? Delivery::Ended : Delivery::Delivering);

    queues.run(replay ? lossless() : FusionWorkerSettings{});

    const Snapshot* snapshot = queues.publish.snapshots.front();
    ASSERT_NE(snapshot, nullptr);
    EXPECT_EQ(snapshot->instants.exposed_at, kStart);
    EXPECT_EQ(snapshot->instants.received_at.has_value(), !replay);
    EXPECT_EQ(snapshot->instants.detected_at.has_value(), !replay);
    EXPECT_EQ(snapshot->instants.fused_at.has_value(), !replay);
  }
}

TEST(FusionWorker, TellsTheRecorderOfTakesWhatASetExpected) {
  Queues queues(8);
  queues.deliver(queues.west, CameraId{0}, {0, 1}, Delivery::Ended);
  queues.deliver(queues.east, CameraId{1}, {0, 1}, Delivery::Ended);

  queues.run(lossless());

  for (const std::uint64_t number : {0, 1}) {
    const Snapshot* snapshot = queues.takes.snapshots.front();
    ASSERT_NE(snapshot, nullptr);
    EXPECT_EQ(snapshot->number, number);
    EXPECT_EQ(snapshot->delivering_cameras, 2U);
    queues.takes.snapshots.pop();
  }
}

TEST(FusionWorker, FusesTheNewestSetOnlyIfLate) {
  Queues queues(8);
  queues.deliver(queues.west, CameraId{0}, {0, 1, 2}, Delivery::Delivering);
  queues.deliver(queues.east, CameraId{1}, {0, 1, 2}, Delivery::Delivering);

  queues.run({});

  const Snapshot* snapshot = queues.publish.snapshots.front();
  ASSERT_NE(snapshot, nullptr);
  EXPECT_EQ(snapshot->instants.exposed_at, kStart + milliseconds(20));
  EXPECT_EQ(queues.publish.snapshots.size(), 1U);
  EXPECT_EQ(queues.counters.sets.read(), 3U);
  EXPECT_EQ(queues.counters.passed_over_sets.read(), 2U);
}

// The cameras do not expose together, so each set has one view. Patience has run out for all sets.
TEST(FusionWorker, PassesOverNoSetForAnotherCamerasSet) {
  Queues queues(8);
  queues.deliver(queues.west, CameraId{0}, {0, 1}, Delivery::Delivering);
  queues.deliver(queues.east, CameraId{1}, {2}, Delivery::Delivering);

  queues.run({});

  EXPECT_EQ(queues.publish.snapshots.size(), 2U);
  EXPECT_EQ(queues.publish.snapshots.front()->instants.exposed_at, kStart + milliseconds(10));
  EXPECT_EQ(queues.counters.sets.read(), 3U);
  EXPECT_EQ(queues.counters.passed_over_sets.read(), 1U);  // of west, which has a newer image
}

TEST(FusionWorker, DropsAndCountsSnapshotsIfTheQueueOfTheConsumerIsFull) {
  Queues queues(2);
  queues.deliver(queues.west, CameraId{0}, {0, 1, 2}, Delivery::Delivering);
  queues.deliver(queues.east, CameraId{1}, {0, 1, 2}, Delivery::Delivering);
  FusionWorkerSettings every;
  every.every_set = true;

  queues.run(every);

  EXPECT_EQ(queues.publish.snapshots.size(), 2U);
  EXPECT_EQ(queues.side.snapshots.size(), 3U) << "a full queue does not affect the other";
  EXPECT_EQ(queues.counters.dropped_publish_full.read(), 1U);
  EXPECT_EQ(queues.counters.dropped_side_full.read(), 0U);
}

TEST(FusionWorker, ExecutesAndAnswersTheOrdersOfOperators) {
  Queues queues(8);
  queues.deliver(queues.west, CameraId{0}, {}, Delivery::Ended);
  queues.deliver(queues.east, CameraId{1}, {}, Delivery::Ended);
  SubjectOrder order;
  std::uint64_t number = 70;
  for (const SubjectAction action : {SubjectAction::Remove, SubjectAction::Add, SubjectAction::Reset}) {
    order.number = ++number;
    order.action = action;
    order.subject = SubjectId{static_cast<std::uint32_t>(number - 70)};
    ASSERT_TRUE(queues.control.to_fusion.try_push(order));
  }

  queues.run(lossless());

  EXPECT_EQ(queues.calls.orders, (std::vector<std::string>{"away 1", "present 2", "reset 3"}));
  OrderDone done;
  for (std::uint64_t expected = 71; expected <= 73; ++expected) {
    ASSERT_TRUE(queues.control.from_fusion.try_pop(done));
    EXPECT_EQ(done.order, expected);
    EXPECT_TRUE(done.done);
    EXPECT_FALSE(done.message.empty());
  }
}

TEST(FusionWorker, GivesSnapshotsTheTimecodeOfTheirExposure) {
  Queues queues(8);
  TimecodeClock clock;
  clock.format = {0, 0, 0, 0, 25};
  clock.at = kStart;
  clock.frames_at = 25.0 * 3600.0;
  clock.frames_per_s = 25.0;
  clock.exposures_per_s = 100.0;
  ASSERT_TRUE(queues.timecode.to_fusion.try_push(std::nullopt));
  ASSERT_TRUE(queues.timecode.to_fusion.try_push(clock));
  queues.deliver(queues.west, CameraId{0}, {0, 1, 2, 3, 4, 5}, Delivery::Ended);
  queues.deliver(queues.east, CameraId{1}, {0, 1, 2, 3, 4, 5}, Delivery::Ended);

  queues.run(lossless());

  std::vector<std::string> timecodes;
  while (const Snapshot* oldest = queues.publish.snapshots.front()) {
    ASSERT_TRUE(oldest->timecode);
    timecodes.push_back(text_of(*oldest->timecode) + "." + std::to_string(oldest->timecode->subframe));
    queues.publish.snapshots.pop();
  }
  const std::vector<std::string> expected{"01:00:00:00.0", "01:00:00:00.1", "01:00:00:00.2",
                                          "01:00:00:00.3", "01:00:00:01.0", "01:00:00:01.1"};
  EXPECT_EQ(timecodes, expected);
}

TEST(FusionWorker, GivesNoTimecodeAfterTheEndOfTheClock) {
  Queues queues(8);
  TimecodeClock clock;
  clock.valid_until = kStart + milliseconds(15);
  ASSERT_TRUE(queues.timecode.to_fusion.try_push(clock));
  queues.deliver(queues.west, CameraId{0}, {1, 2}, Delivery::Ended);
  queues.deliver(queues.east, CameraId{1}, {1, 2}, Delivery::Ended);

  queues.run(lossless());

  EXPECT_TRUE(queues.publish.snapshots.front()->timecode);
  queues.publish.snapshots.pop();
  EXPECT_FALSE(queues.publish.snapshots.front()->timecode);
}

}  // namespace fusion_worker_test
}  // namespace mocap::runtime
