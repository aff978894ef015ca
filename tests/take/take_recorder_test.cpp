#include "take/recorder/take_recorder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "example_take.h"
#include "model/search_health.h"
#include "take/take_belief.h"

namespace mocap::take {
namespace take_recorder_test {

namespace fs = std::filesystem;

constexpr std::uint64_t kSecond = 120;  // sets of 1/120 s

class Takes : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("mocap-takes-" + std::to_string(::getpid()));
    fs::remove_all(folder);
    settings.folder = folder;
    settings.min_free_mb = 1;
    settings.memory_mb = 64;
    restart();
  }
  void TearDown() override {
    recorder.reset();
    fs::remove_all(folder);
  }

  void restart() {
    recorder = make_take_recorder(settings, example_description(), {{.name = "mocapd.toml", .bytes = "[detect]\n"}});
  }

  void keep_set() {
    for (std::uint32_t camera = 0; camera < kExampleCameras; ++camera) recorder->keep(example_blobs(camera, next));
    recorder->keep(example_snapshot(next));
    ++next;
  }
  void capture(std::uint64_t sets) {
    for (const std::uint64_t end = next + sets; next < end;) {
      keep_set();
      recorder->work(now());
    }
  }
  // While the disk thread waits for the disk.
  void capture_without_disk(std::uint64_t sets) {
    for (const std::uint64_t end = next + sets; next < end;) keep_set();
  }

  // Just before the exposure of the next set.
  Timestamp now() const { return example_time(next) - Duration(1000); }

  void follow(TakeOrder order) {
    order.number = ++orders;
    order.at = now();
    recorder->follow(order);
  }
  TakeDone order(const TakeOrder& order) {
    follow(order);
    recorder->work(now());
    auto answer = recorder->next_answer();
    if (!answer) {
      capture(2);  // a take ends when the snapshots of its last instant came
      answer = recorder->next_answer();
    }
    if (!answer) return {0, TakeOutcome::Failed, "no answer"};
    EXPECT_EQ(answer->order, orders);
    return *std::move(answer);
  }
  TakeDone start(const std::string& name = {}) { return order({.action = TakeAction::Start, .name = name}); }
  TakeDone stop() { return order({.action = TakeAction::Stop}); }
  // The answer to each order since the last call, by its number.
  std::map<std::uint64_t, TakeDone> answers() {
    std::map<std::uint64_t, TakeDone> all;
    while (auto answer = recorder->next_answer()) all[answer->order] = *std::move(answer);
    return all;
  }

  std::set<std::uint64_t> sets_of(const std::string& name) const {
    std::set<std::uint64_t> sets;
    const auto reader = TakeReader::open(folder / (name + ".mcap"));
    if (!reader) {
      ADD_FAILURE() << reader.error().message;
      return sets;
    }
    EXPECT_FALSE(reader->cut_off());
    const auto file = reader->file("mocapd.toml");
    EXPECT_TRUE(file && *file == "[detect]\n");
    TakeCursor cursor = reader->messages({{TakeTopic::Snapshot}, {}, {}});
    for (auto record = cursor.next(); record && *record; record = cursor.next()) {
      sets.insert(snapshot_of(**record)->number);
    }
    std::map<std::string, std::uint64_t> counts = reader->counts();
    EXPECT_NEAR(static_cast<double>(counts["blobs/camera0"]), static_cast<double>(sets.size()), 2.0);
    return sets;
  }

  fs::path folder;
  TakesSettings settings;
  std::unique_ptr<TakeRecorder> recorder;
  std::uint64_t next = 0;  // set
  std::uint64_t orders = 0;
};

std::set<std::uint64_t> range(std::uint64_t from, std::uint64_t to) {
  std::set<std::uint64_t> all;
  for (; from < to; ++from) all.insert(from);
  return all;
}

TEST_F(Takes, HaveEverySetFromStartToStop) {
  capture(kSecond);
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(2 * kSecond);
  const TakeDone stopped = stop();

  EXPECT_EQ(stopped.outcome, TakeOutcome::Done) << stopped.message;
  EXPECT_NE(stopped.message.find("take_001.mcap' ended"), std::string::npos) << stopped.message;
  EXPECT_EQ(sets_of("take_001"), range(kSecond, 3 * kSecond));
  EXPECT_EQ(recorder->health().state, TakeState::Ended);
  EXPECT_EQ(recorder->health().sets, 2 * kSecond);
  EXPECT_EQ(recorder->health().lost_sets, 0U);
}

TEST_F(Takes, BeginWithTheBeliefOfTheFusionAndTheSetsSinceThen) {
  capture(kSecond);
  Belief belief;
  belief.after_set = next - 1;
  belief.at = example_time(belief.after_set);
  belief.size = 1000;
  std::fill_n(belief.memory.get(), belief.size, std::byte{7});
  recorder->keep(belief);
  capture(kSecond / 2);
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const auto reader = TakeReader::open(folder / "take_001.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  const auto found = belief_of(*reader);
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->after_set(), kSecond - 1);
  EXPECT_EQ((*found)->state(), std::string(1000, '\7'));
  EXPECT_EQ((*found)->sets_size(), static_cast<int>(kSecond / 2));
  EXPECT_GE((*found)->images_size(), static_cast<int>(kExampleCameras * kSecond / 2));
  EXPECT_EQ(*sets_of("take_001").begin(), kSecond + kSecond / 2) << "the sets before are no part of the take";
}

TEST_F(Takes, HaveNoBeliefIfTheyEndEarly) {
  Belief belief;
  belief.at = example_time(next);
  recorder->keep(belief);
  capture(1);
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  Description other = example_description();
  other.cameras.pop_back();
  recorder->describe(other, {}, now());
  recorder->work(now());
  ASSERT_EQ(recorder->health().state, TakeState::Failed);

  const auto found = belief_of(*TakeReader::open(folder / "take_001.mcap"));

  EXPECT_TRUE(found && !*found);
}

TEST_F(Takes, HaveNoBeliefOfTheTimeAfterTheirStart) {
  capture(kSecond);
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  Belief belief;
  belief.after_set = next - 1;
  belief.at = example_time(next);
  recorder->keep(belief);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const auto found = belief_of(*TakeReader::open(folder / "take_001.mcap"));

  EXPECT_TRUE(found && !*found);
}

TEST_F(Takes, IncludeWhatAlreadyHappened) {
  capture(3 * kSecond);
  ASSERT_EQ(order({.action = TakeAction::Start, .before = std::chrono::seconds(2)}).outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const std::set<std::uint64_t> sets = sets_of("take_001");
  EXPECT_EQ(*sets.begin(), kSecond);
  EXPECT_EQ(sets, range(*sets.begin(), 4 * kSecond));
}

// The daemon has just started: its first images were exposed, and are still on their way.
TEST_F(Takes, HaveTheFirstSetsOfTheRunThatComeAfterTheOrder) {
  next = 10;
  ASSERT_EQ(order({.action = TakeAction::Start, .before = std::chrono::seconds(2)}).outcome, TakeOutcome::Done);
  next = 4;
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_EQ(*sets_of("take_001").begin(), 4U);
  EXPECT_EQ(TakeReader::open(folder / "take_001.mcap")->info().others.at(kFirstSetOfRun), "4");
}

TEST_F(Takes, AreNumberedAndNeverOverwritten) {
  capture(2);
  ASSERT_EQ(start("walk").outcome, TakeOutcome::Done);
  capture(10);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);
  const auto size = fs::file_size(folder / "walk.mcap");

  const TakeDone again = start("walk");

  EXPECT_EQ(again.outcome, TakeOutcome::Invalid);
  EXPECT_NE(again.message.find("the next free name is 'walk-2'"), std::string::npos) << again.message;
  EXPECT_EQ(fs::file_size(folder / "walk.mcap"), size);
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(order({.action = TakeAction::Start, .slate = "run"}).outcome, TakeOutcome::Done);
    capture(10);
    ASSERT_EQ(stop().outcome, TakeOutcome::Done);
  }
  EXPECT_TRUE(fs::exists(folder / "run_001.mcap"));
  EXPECT_TRUE(fs::exists(folder / "run_002.mcap"));
}

TEST_F(Takes, NextGoesOnWithoutAGap) {
  capture(2);
  ASSERT_EQ(order({.action = TakeAction::Start, .slate = "run"}).outcome, TakeOutcome::Done);
  capture(kSecond);
  const TakeDone second = order({.action = TakeAction::Next, .before = std::chrono::milliseconds(1)});
  ASSERT_EQ(second.outcome, TakeOutcome::Done) << second.message;
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  std::set<std::uint64_t> both = sets_of("run_001");
  both.merge(sets_of("run_002"));
  EXPECT_EQ(both, range(2, *both.rbegin() + 1));
}

// Its order is followed late, because the disk thread waited for the disk.
TEST_F(Takes, BeginAndEndAtTheInstantsOfTheirOrders) {
  capture(kSecond);
  const TakeOrder start{.number = 1, .action = TakeAction::Start, .at = now()};
  capture(kSecond);
  const TakeOrder stop{.number = 2, .action = TakeAction::Stop, .at = now()};
  recorder->follow(start);
  recorder->follow(stop);
  capture(2);

  EXPECT_EQ(sets_of("take_001"), range(kSecond, 2 * kSecond));
}

TEST_F(Takes, AreWrittenToTheirEndIfTheDiskWasSlowThen) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  const std::uint64_t sets = 60 * kSecond;  // several times what `work` writes at once
  capture_without_disk(sets);
  follow({.action = TakeAction::Stop});
  capture_without_disk(kSecond);
  for (int i = 0; i < 100 && recorder->health().state == TakeState::Recording; ++i) recorder->work(now());

  EXPECT_EQ(sets_of("take_001"), range(0, sets));
}

TEST_F(Takes, ThatWereStoppedAreNotCutShortByTheEndOfTheRecorder) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  follow({.action = TakeAction::Stop});
  recorder->finish(now(), "a reload changed [takes]");

  EXPECT_EQ(recorder->health().state, TakeState::Ended);
  EXPECT_EQ(sets_of("take_001"), range(0, kSecond));
}

TEST_F(Takes, StartRightAfterAStop) {
  ASSERT_EQ(start("walk").outcome, TakeOutcome::Done);
  capture(kSecond);
  follow({.action = TakeAction::Stop});
  follow({.action = TakeAction::Start, .name = "run"});
  follow({.action = TakeAction::Start, .name = "fall"});
  capture(kSecond);
  const auto answered = answers();
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_NE(answered.at(2).message.find("walk.mcap' ended"), std::string::npos) << answered.at(2).message;
  EXPECT_EQ(answered.at(3).outcome, TakeOutcome::Done) << answered.at(3).message;
  EXPECT_EQ(answered.at(4).outcome, TakeOutcome::Failed);
  EXPECT_EQ(sets_of("walk"), range(0, kSecond));
  EXPECT_EQ(sets_of("run"), range(kSecond, 2 * kSecond));
}

TEST_F(Takes, ThatAreAboutToStartAreDroppedByAStopOrACancel) {
  for (const TakeAction action : {TakeAction::Stop, TakeAction::Cancel}) {
    const std::uint64_t first = orders;
    ASSERT_EQ(start().outcome, TakeOutcome::Done);
    capture(kSecond);
    follow({.action = TakeAction::Next});
    follow({.action = action});
    capture(kSecond);

    const auto answered = answers();
    EXPECT_EQ(answered.at(first + 2).outcome, TakeOutcome::Failed);
    EXPECT_EQ(answered.at(first + 3).outcome, TakeOutcome::Done);
    EXPECT_EQ(recorder->health().state, TakeState::Ended);
  }
  EXPECT_EQ(sets_of("take_001").size(), kSecond);
  EXPECT_EQ(sets_of("take_002").size(), kSecond);
  EXPECT_FALSE(fs::exists(folder / "take_003.mcap"));
}

TEST_F(Takes, AreStoppedAndCancelledByNoOrderForAnother) {
  ASSERT_EQ(start("walk").outcome, TakeOutcome::Done);
  capture(kSecond);
  EXPECT_EQ(start("run").outcome, TakeOutcome::Failed);
  EXPECT_EQ(order({.action = TakeAction::Stop, .name = "run"}).outcome, TakeOutcome::NotFound);
  EXPECT_EQ(order({.action = TakeAction::Cancel, .name = "run"}).outcome, TakeOutcome::NotFound);
  follow({.action = TakeAction::Next, .name = "jump"});
  follow({.action = TakeAction::Cancel, .name = "run"});
  follow({.action = TakeAction::Stop, .name = "jump"});
  capture(kSecond);

  const auto answered = answers();
  EXPECT_EQ(answered.at(orders - 1).message, "'run' is not the take in progress");
  EXPECT_EQ(answered.at(orders).outcome, TakeOutcome::Done);
  EXPECT_EQ(sets_of("walk").size(), kSecond);
  EXPECT_FALSE(fs::exists(folder / "jump.mcap"));
}

TEST_F(Takes, ThatWereStoppedAreWholeIfTheCamerasChangeBeforeTheyAreWritten) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture_without_disk(10);
  follow({.action = TakeAction::Stop});
  capture_without_disk(1);
  Description other = example_description();
  other.cameras.pop_back();
  recorder->describe(other, {}, now());
  recorder->work(now());

  EXPECT_EQ(recorder->health().state, TakeState::Ended);
}

TEST_F(Takes, AreKeptIfTheyAreCancelledAfterTheirStop) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  follow({.action = TakeAction::Stop});
  follow({.action = TakeAction::Cancel});
  capture(2);

  EXPECT_EQ(answers().at(3).outcome, TakeOutcome::NotFound);
  EXPECT_EQ(sets_of("take_001"), range(0, kSecond));
}

TEST_F(Takes, GoOnIfAnOrderForTheNextOneIsWrong) {
  ASSERT_EQ(start("walk").outcome, TakeOutcome::Done);
  capture(10);
  const std::vector<TakeOrder> wrong{
      {.action = TakeAction::Next, .name = "walk"},
      {.action = TakeAction::Next, .slate = "a/b"},
      {.action = TakeAction::Next, .before = settings.before + std::chrono::seconds(1)},
      {.action = TakeAction::Next, .text = std::string(kMaxInfo_bytes + 1, 'n')},
      {.action = TakeAction::Next, .at_timecode = Timecode{10, 0, 0, 0, 30}},
  };
  for (const TakeOrder& bad : wrong) {
    EXPECT_EQ(order(bad).outcome, TakeOutcome::Invalid);
    EXPECT_EQ(recorder->health().state, TakeState::Recording);
  }
  capture(10);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_EQ(sets_of("walk"), range(0, 20));
}

TEST_F(Takes, HaveNotesWithoutControlCharacters) {
  ASSERT_EQ(order({.action = TakeAction::Start, .text = "prop\tfell\r\ntwice\x1b"}).outcome, TakeOutcome::Done);
  capture(10);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_EQ(TakeReader::open(folder / "take_001.mcap")->info().notes, "prop fell\ntwice ");
}

TEST_F(Takes, SayHowManySetsTheRecorderWasLateFor) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  next += 3;
  recorder->count_dropped(0, 3);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const std::string reasons(text_of(recorder->health().reasons));
  EXPECT_NE(reasons.find("3 of 243 sets lost, 3 because the recorder was late ([queues] side_snapshots)"),
            std::string::npos)
      << reasons;
}

TEST_F(Takes, EndAfterTheirLength) {
  ASSERT_EQ(order({.action = TakeAction::Start, .length = std::chrono::seconds(1)}).outcome, TakeOutcome::Done);
  capture(2 * kSecond);

  EXPECT_EQ(recorder->health().state, TakeState::Ended);
  EXPECT_NEAR(static_cast<double>(sets_of("take_001").size()), 120.0, 1.0);
}

TEST_F(Takes, StartAfterACountdown) {
  ASSERT_EQ(order({.action = TakeAction::Start, .countdown = std::chrono::seconds(1)}).outcome, TakeOutcome::Done);
  EXPECT_EQ(recorder->health().state, TakeState::Waiting);
  capture(2 * kSecond);
  EXPECT_EQ(recorder->health().state, TakeState::Recording);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_NEAR(static_cast<double>(*sets_of("take_001").begin()), 120.0, 2.0);
}

TEST_F(Takes, ThatAreCancelledLeaveNoFile) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);

  EXPECT_EQ(order({.action = TakeAction::Cancel}).outcome, TakeOutcome::Done);

  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_EQ(recorder->health().state, TakeState::Cancelled);
  EXPECT_EQ(stop().outcome, TakeOutcome::NotFound);
}

TEST_F(Takes, HaveTheMarksOfTheOperator) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(order({.action = TakeAction::Mark, .text = "prop fell"}).outcome, TakeOutcome::Done);
  capture(10);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const auto reader = TakeReader::open(folder / "take_001.mcap");
  ASSERT_TRUE(reader);
  TakeCursor cursor = reader->messages({{TakeTopic::Event}, {}, {}});
  std::vector<std::string> marks;  // among the events of the subject
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    const auto event = event_of(**record);
    ASSERT_TRUE(event);
    if (event->kind() == v1::EVENT_KIND_MARK) marks.push_back(event->message());
  }
  EXPECT_EQ(marks, std::vector<std::string>{"prop fell"});
}

TEST_F(Takes, EndWhenTheirFolderIsRemoved) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(10);
  fs::remove_all(folder);
  capture(2 * kSecond);

  EXPECT_EQ(recorder->health().state, TakeState::Failed);
  EXPECT_NE(text_of(recorder->health().message).find("was removed"), std::string_view::npos);
}

TEST_F(Takes, DoNotStartWithTooLittleFreeSpace) {
  settings.min_free_mb = 1'000'000'000;
  restart();

  const TakeDone refused = start();

  EXPECT_EQ(refused.outcome, TakeOutcome::Failed);
  EXPECT_NE(refused.message.find("min_free_mb"), std::string::npos) << refused.message;
}

TEST_F(Takes, OfTheSameCamerasGoOnThroughAChangeOfTheConfiguration) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  Description changed = example_description();
  changed.version = 2;
  recorder->describe(changed, {{.name = "mocapd.toml", .bytes = "[detect]\n"}}, now());
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_EQ(sets_of("take_001"), range(0, 2 * kSecond));
  EXPECT_EQ(TakeReader::open(folder / "take_001.mcap")->counts()["description"], 2U);
}

TEST_F(Takes, CarryTheFilesOfTheConfigurationInForce) {
  recorder->describe(example_description(), {{.name = "mocapd.toml", .bytes = "[label]\n"}}, now());
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_EQ(*TakeReader::open(folder / "take_001.mcap")->file("mocapd.toml"), "[label]\n");
}

TEST_F(Takes, HaveTheImagesOfTheirLastSet) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  recorder->keep(example_blobs(0, next));
  BlobFrame late = example_blobs(1, next);
  late.exposed_at = example_time(next) + std::chrono::microseconds(300);
  recorder->keep(late);
  Snapshot last = example_snapshot(next);
  last.delivering_cameras = 2;
  last.views.clear();
  last.views.push_back({CameraId{0}, next, Duration(0), 9});
  last.views.push_back({CameraId{1}, late.number, late.exposed_at - example_time(next), 9});
  recorder->keep(last);
  recorder->follow({.number = 9, .action = TakeAction::Stop, .at = example_time(next)});
  ++next;
  capture(2);

  const auto reader = TakeReader::open(folder / "take_001.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  auto counts = reader->counts();
  EXPECT_EQ(counts["blobs/camera1"], counts["snapshot"]);
  TakeCursor cursor = reader->messages({.topics = {TakeTopic::Snapshot}});
  std::vector<std::uint32_t> delivering;
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    const auto message = snapshot_message_of(**record);
    ASSERT_TRUE(message);
    delivering.push_back(message->has_delivering_cameras() ? message->delivering_cameras() : 0);
  }
  ASSERT_FALSE(delivering.empty());
  EXPECT_EQ(delivering.front(), 0U) << "unknown";
  EXPECT_EQ(delivering.back(), 2U);
}

// With a wide [align] window_us, camera 0 exposes 2 ms before the mean of the set and camera 1 2 ms after it.
class TakesOfSpreadSets : public Takes {
 protected:
  void capture_spread(std::uint64_t sets) {
    constexpr Duration kSkew = std::chrono::milliseconds(2);
    for (const std::uint64_t end = next + sets; next < end; ++next) {
      Snapshot snapshot = example_snapshot(next);
      snapshot.views.clear();
      for (std::uint32_t camera = 0; camera < kExampleCameras; ++camera) {
        const Duration skew = camera == 0 ? -kSkew : kSkew;
        BlobFrame frame = example_blobs(camera, next);
        frame.exposed_at = example_time(next) + skew;
        recorder->keep(frame);
        snapshot.views.push_back({CameraId{camera}, frame.number, skew, 9});
      }
      recorder->keep(snapshot);
      recorder->work(now());
    }
  }
};

TEST_F(TakesOfSpreadSets, HaveTheImagesOfTheirFirstAndLastSet) {
  capture_spread(kSecond);
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture_spread(kSecond);
  recorder->follow({.number = 9, .action = TakeAction::Stop, .at = example_time(next)});  // the mean of the last set
  capture_spread(2);

  EXPECT_EQ(recorder->health().state, TakeState::Ended);
  std::map<std::pair<std::uint32_t, std::int64_t>, int> images;  // by camera and exposure
  const auto reader = TakeReader::open(folder / "take_001.mcap");
  ASSERT_TRUE(reader) << reader.error().message;
  TakeCursor cursor = reader->messages({.topics = {TakeTopic::Blobs}});
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    const auto frame = blobs_of(**record);
    ASSERT_TRUE(frame) << frame.error().message;
    ++images[{frame->camera.value, to_ns(frame->exposed_at)}];
  }
  std::uint64_t sets = 0;
  TakeCursor snapshots = reader->messages({.topics = {TakeTopic::Snapshot}});
  for (auto record = snapshots.next(); record && *record; record = snapshots.next(), ++sets) {
    const auto snapshot = snapshot_of(**record);
    ASSERT_TRUE(snapshot) << snapshot.error().message;
    for (const ViewStatus& view : snapshot->views) {
      EXPECT_EQ((images[{view.camera.value, to_ns(snapshot->instants.exposed_at + view.skew)}]), 1)
          << "set " << snapshot->number << ", camera " << view.camera.value;
    }
  }
  EXPECT_EQ(sets, kSecond + 1);
}

TEST_F(Takes, EndWhereTheCamerasChange) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  Description changed = example_description();
  changed.cameras[0].name = "another";
  recorder->describe(changed, {}, now());
  capture(1);

  EXPECT_EQ(recorder->health().state, TakeState::Failed);
  EXPECT_EQ(sets_of("take_001"), range(0, kSecond));
}

TEST_F(Takes, EndWithTheDaemon) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  follow({.action = TakeAction::Next});
  recorder->finish(now(), {});

  EXPECT_EQ(recorder->health().state, TakeState::Ended);
  EXPECT_EQ(sets_of("take_001"), range(0, kSecond));
  EXPECT_EQ(answers().at(2).outcome, TakeOutcome::Failed);
  EXPECT_FALSE(fs::exists(folder / "take_002.mcap"));
}

TEST_F(Takes, NameTheReasonIfAnotherRecorderFollows) {
  ASSERT_EQ(start().outcome, TakeOutcome::Done);
  capture(kSecond);
  recorder->finish(now(), "a reload changed [takes]");

  EXPECT_EQ(recorder->health().state, TakeState::Failed);
  EXPECT_EQ(sets_of("take_001"), range(0, kSecond));
  EXPECT_EQ(TakeReader::open(folder / "take_001.mcap")->info().others.at("ended_early"), "a reload changed [takes]");
}

// A source of timecode that has `start` at the first set.
TimecodeHealth timecode_from(const Timecode& start, bool runs = true) {
  TimecodeHealth health;
  health.source = TimecodeSourceKind::Ltc;
  health.format = start;
  health.sentence = bounded_text<255>(runs ? "" : "no timecode because it does not run");
  if (!runs) return health;
  health.state = TimecodeState::Locked;
  health.clock = TimecodeClock{};
  health.clock->format = start;
  health.clock->at = example_time(0);
  health.clock->frames_at = static_cast<double>(frames_of(start));
  health.clock->frames_per_s = rate_hz(start);
  return health;
}

TEST_F(Takes, StartAtATimecode) {
  const Timecode start{10, 0, 0, 0, 30};
  recorder->set_timecode(timecode_from(start), now());
  capture(kSecond);
  const TakeDone waits = order({.action = TakeAction::Start, .name = "at", .at_timecode = Timecode{10, 0, 2, 15, 100}});
  EXPECT_EQ(waits.outcome, TakeOutcome::Done);
  EXPECT_NE(waits.message.find("starts at 10:00:02:15; in 1.5 s"), std::string::npos) << waits.message;
  EXPECT_EQ(recorder->health().state, TakeState::Waiting);
  capture(2 * kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_NEAR(static_cast<double>(*sets_of("at").begin()), 2.5 * kSecond, 1.0);
}

TEST_F(Takes, WaitForATimecodeThatDoesNotRunYet) {
  recorder->set_timecode(timecode_from({10, 0, 0, 0, 25}, false), now());
  capture(kSecond);
  const TakeDone waits = order({.action = TakeAction::Start, .name = "at", .at_timecode = Timecode{10, 0, 1, 0, 100}});
  EXPECT_NE(waits.message.find("does not run"), std::string::npos) << waits.message;
  capture(kSecond);
  EXPECT_EQ(recorder->health().state, TakeState::Waiting);

  // The source has run from set 120 on, and is known 0.25 s later: the take begins where the timecode passed.
  TimecodeHealth runs = timecode_from({10, 0, 1, 0, 25});
  runs.clock->at = example_time(2 * kSecond);
  capture(kSecond / 4);
  recorder->set_timecode(runs, now());
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_NEAR(static_cast<double>(*sets_of("at").begin()), 2.0 * kSecond, 1.0);
}

TEST_F(Takes, RefuseATimecodeThatCannotCome) {
  const TakeDone none = order({.action = TakeAction::Start, .at_timecode = Timecode{10, 0, 0, 0, 100}});
  recorder->set_timecode(timecode_from({10, 0, 0, 0, 30, true}), now());
  const TakeDone dropped = order({.action = TakeAction::Start, .at_timecode = Timecode{10, 1, 0, 0, 100}});
  const TakeDone large = order({.action = TakeAction::Start, .at_timecode = Timecode{10, 1, 0, 30, 100}});

  EXPECT_EQ(none.outcome, TakeOutcome::Invalid);
  EXPECT_NE(none.message.find("source is \"none\""), std::string::npos) << none.message;
  EXPECT_EQ(dropped.outcome, TakeOutcome::Invalid);
  EXPECT_NE(dropped.message.find("10:01:00;00 does not exist"), std::string::npos) << dropped.message;
  EXPECT_EQ(large.outcome, TakeOutcome::Invalid);
}

TEST_F(Takes, HaveTheTimecodeOfTheirSnapshots) {
  ASSERT_EQ(start("coded").outcome, TakeOutcome::Done);
  for (std::uint32_t frame = 3; frame < 20; ++frame) {
    Snapshot snapshot = example_snapshot(next);
    snapshot.timecode = Timecode{1, 2, 3, frame, 25};
    recorder->keep(snapshot);
    recorder->work(now());
    ++next;
  }
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const auto reader = TakeReader::open(folder / "coded.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->info().start_timecode, "01:02:03:03");
  EXPECT_EQ(reader->info().end_timecode, "01:02:03:19");
  EXPECT_EQ(reader->info().others.at("timecode_rate"), "25");
}

TEST_F(Takes, FollowTheShotList) {
  settings.shots = folder / "shot_list.csv";
  restart();
  const std::vector<Shot> shots{{"walk", "A1", "slow", {}}, {"run", "A2", "", {}}, {"fall", "", "", {}}};
  const TakeDone imported = order({.action = TakeAction::ImportShots, .shots = shots});
  ASSERT_EQ(imported.outcome, TakeOutcome::Done) << imported.message;
  EXPECT_EQ(imported.shots->size(), 3U);
  capture(2);

  const TakeDone walk = order({.action = TakeAction::Next});
  EXPECT_NE(walk.message.find("shot 'walk', 2 left, next 'run'"), std::string::npos) << walk.message;
  capture(kSecond);
  ASSERT_EQ(order({.action = TakeAction::Next}).outcome, TakeOutcome::Done);  // ends walk, starts run
  capture(kSecond);
  ASSERT_EQ(order({.action = TakeAction::Cancel}).outcome, TakeOutcome::Done);  // run is to be taken again
  restart();
  capture(2);
  ASSERT_EQ(order({.action = TakeAction::Next}).outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  const auto reader = TakeReader::open(folder / "walk.mcap");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->info().slate, "A1");
  EXPECT_EQ(reader->info().notes, "slow");
  EXPECT_TRUE(fs::exists(folder / "run.mcap"));
  const TakeDone list = order({.action = TakeAction::ListShots});
  std::vector<bool> done;
  for (const Shot& shot : *list.shots) done.push_back(shot.done);
  EXPECT_EQ(done, (std::vector<bool>{true, true, false}));
}

TEST_F(Takes, GoOnWithTheirSlateAfterTheLastShot) {
  ASSERT_EQ(order({.action = TakeAction::ImportShots, .shots = {{"walk", "A1", "", {}}}}).outcome, TakeOutcome::Done);
  capture(2);
  ASSERT_EQ(order({.action = TakeAction::Next}).outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(order({.action = TakeAction::Next}).outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_TRUE(fs::exists(folder / "A1_001.mcap"));
}

TEST_F(Takes, OfAShotThatWasTakenBeforeGetANumber) {
  ASSERT_EQ(start("walk").outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);
  ASSERT_EQ(order({.action = TakeAction::ImportShots, .shots = {{"walk", "", "", {}}}}).outcome, TakeOutcome::Done);
  ASSERT_EQ(order({.action = TakeAction::Next}).outcome, TakeOutcome::Done);
  capture(kSecond);
  ASSERT_EQ(stop().outcome, TakeOutcome::Done);

  EXPECT_TRUE(fs::exists(folder / "walk-2.mcap"));
  EXPECT_EQ(order({.action = TakeAction::ClearShots}).shots->size(), 0U);
}

}  // namespace take_recorder_test
}  // namespace mocap::take
