#include "runtime/take_worker.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "model/search_health.h"

namespace mocap::runtime {
namespace take_worker_test {

constexpr int kPatience_ms = 60'000;

// Starts at once, and ends a take with the next call of `work`.
class ScriptedRecorder final : public TakeRecorder {
 public:
  void keep(const BlobFrame&) override {}
  void keep(const Snapshot&) override {}
  void keep(const Health&) override {}
  void keep(const Belief&) override {}
  void learn(const SubjectFit&) override {}
  void count_dropped(std::uint64_t images, std::uint64_t sets) override {
    dropped_images += images;
    dropped_sets += sets;
  }
  void describe(const Description&, std::vector<TakeFile>, Timestamp) override {}
  void set_timecode(const TimecodeHealth&, Timestamp) override {}

  void follow(const TakeOrder& order) override {
    followed.push_back(order.number);
    if (order.action == TakeAction::Stop && take_.state == TakeState::Recording) {
      stopped_by_ = order.number;
      return;
    }
    if (order.action == TakeAction::Cancel) {
      take_.state = TakeState::Cancelled;
      return answers_.push_back({order.number, TakeOutcome::Done, "cancelled"});
    }
    const bool starts = order.action == TakeAction::Start && take_.state != TakeState::Recording;
    if (starts) begin(order.name);
    answers_.push_back({order.number, starts ? TakeOutcome::Done : TakeOutcome::Failed, order.name});
  }
  bool work(Timestamp) override {
    if (stopped_by_ == 0) return false;
    take_.state = TakeState::Ended;
    answers_.push_back({stopped_by_, TakeOutcome::Done, "ended"});
    stopped_by_ = 0;
    return false;
  }
  std::optional<TakeDone> next_answer() override {
    if (answers_.empty()) return std::nullopt;
    TakeDone answer = answers_.front();
    answers_.pop_front();
    return answer;
  }
  TakeHealth health() const override { return take_; }
  void finish(Timestamp, const std::string&) override {
    if (take_.state == TakeState::Recording) take_.state = TakeState::Ended;
  }

  std::uint64_t dropped_images = 0, dropped_sets = 0;
  std::vector<std::uint64_t> followed;  // numbers of orders

 private:
  void begin(const std::string& name) {
    take_.state = TakeState::Recording;
    take_.name = bounded_text<255>(name);
    ++take_.takes;
  }

  TakeHealth take_;
  std::uint64_t stopped_by_ = 0;
  std::deque<TakeDone> answers_;
};

// The audit log of a test.
class NotedTakes final : public AuditTrail {
 public:
  void note(AuditEntry entry) override {
    const std::lock_guard lock(mutex_);
    words_.push_back(entry.what + " " + entry.who.name);
  }
  bool write(AuditEntry, Duration) override { return true; }
  AuditHealth health() const override { return {}; }

  std::vector<std::string> words() const {
    const std::lock_guard lock(mutex_);
    return words_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> words_;
};

// The disk thread, and this test as control thread and trigger thread.
class TakeWorkerTest : public testing::Test {
 protected:
  ~TakeWorkerTest() override {
    disk.request_stop();
    channel.ordered.signal();
  }

  void start() {
    disk = std::jthread([this](const std::stop_token& stop) { worker.run_disk(stop); });
  }
  void order(SpscQueue<TakeOrder>& queue, std::uint64_t number, TakeAction action, const std::string& name = {}) {
    ASSERT_TRUE(queue.try_push({.number = number, .action = action, .name = name}));
    channel.ordered.signal();
  }
  void push(SpscQueue<TakeOrder>& queue, TakeAction action, const char* who) {
    ASSERT_TRUE(queue.try_push({.number = 1, .action = action, .by = {.name = who}}));
    channel.ordered.signal();
  }
  TakeNews next_news() {
    for (;;) {
      channel.news_came.clear();
      TakeNews news;
      if (channel.news.try_pop(news)) return news;
      pollfd wanted{channel.news_came.number(), POLLIN, 0};
      if (::poll(&wanted, 1, kPatience_ms) == 1) continue;
      ADD_FAILURE() << "no news";
      return {};
    }
  }
  TakeDone next_answer() {
    TakeDone answer;
    for (int tries = 0; tries < kPatience_ms && !channel.done.try_pop(answer); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return answer;
  }

  WakeSignal wake;
  SnapshotChannel snapshots{4};
  SpscQueue<Belief> beliefs{1};
  TakeChannel channel;
  TimecodeChannel timecode;
  NotedTakes audit;
  Counter dropped_sets;
  ScriptedRecorder* recorder = new ScriptedRecorder;
  TakeWorker worker{
      std::unique_ptr<TakeRecorder>(recorder), {}, snapshots, {beliefs, channel, timecode, dropped_sets, wake, &audit}};
  std::jthread disk;
};

TEST_F(TakeWorkerTest, NotesWhoBeganAndEndedATakeAndTheEndThatNobodyOrdered) {
  start();
  const auto order_by = [&](SpscQueue<TakeOrder>& queue, TakeAction action, const char* who, std::size_t noted) {
    push(queue, action, who);
    while (audit.words().size() < noted) std::this_thread::yield();
  };

  order_by(channel.orders, TakeAction::Start, "anna", 1);
  order_by(channel.orders, TakeAction::Stop, "ben", 2);
  order_by(channel.trigger_orders, TakeAction::Start, "trigger", 4);
  disk.request_stop();
  channel.ordered.signal();
  disk.join();
  worker.finish();

  EXPECT_EQ(audit.words(), (std::vector<std::string>{"recorded anna", "retained ben", "ordered trigger",
                                                     "recorded trigger", "retained "}));
}

TEST_F(TakeWorkerTest, NotesEachTakeOfOrdersThatWaitedForTheDisk) {
  push(channel.orders, TakeAction::Start, "anna");
  push(channel.orders, TakeAction::Cancel, "ben");
  push(channel.orders, TakeAction::Start, "cleo");
  start();
  for (int answers = 0; answers < 3; ++answers) next_answer();

  EXPECT_EQ(audit.words(), (std::vector<std::string>{"recorded anna", "discarded ben", "recorded cleo"}));
}

TEST_F(TakeWorkerTest, GivesTheTriggerItsAnswersAndTheTakeThatTheyMade) {
  channel.news_wanted = true;
  start();
  EXPECT_EQ(next_news().take->state, TakeState::None);  // as it is at the start

  order(channel.trigger_orders, 7, TakeAction::Start, "walk");
  const TakeNews started = next_news();
  EXPECT_EQ(started.order, 7U);
  ASSERT_TRUE(started.done && started.take);
  EXPECT_EQ(started.done->order, 7U);
  EXPECT_EQ(text_of(started.take->name), "walk");

  order(channel.trigger_orders, 8, TakeAction::Stop);
  const TakeNews executing = next_news();
  EXPECT_EQ(executing.order, 8U);
  EXPECT_FALSE(executing.done);
  const TakeNews ended = next_news();
  EXPECT_EQ(ended.order, 8U);
  ASSERT_TRUE(ended.done);
  EXPECT_EQ(ended.take->state, TakeState::Ended);

  order(channel.trigger_orders, 9, TakeAction::Mark);
  EXPECT_EQ(next_news().done->outcome, TakeOutcome::Failed);
  TakeDone none;
  EXPECT_FALSE(channel.done.try_pop(none));
}

TEST_F(TakeWorkerTest, TellsTheTriggerOfTakesOfOperators) {
  channel.news_wanted = true;
  start();
  next_news();

  order(channel.orders, 7, TakeAction::Start, "run");

  EXPECT_EQ(next_answer().order, 7U);
  const TakeNews started = next_news();
  EXPECT_EQ(started.order, 0U);
  EXPECT_FALSE(started.done);
  EXPECT_EQ(started.take->state, TakeState::Recording);
}

TEST_F(TakeWorkerTest, KeepsNoNewsWithoutATrigger) {
  start();
  order(channel.orders, 7, TakeAction::Start, "run");

  EXPECT_EQ(next_answer().outcome, TakeOutcome::Done);
  EXPECT_EQ(channel.news.size(), 0U);
}

TEST_F(TakeWorkerTest, FollowsTheOrdersOfOperatorsAndTriggersAsTheyCame) {
  const auto push = [](SpscQueue<TakeOrder>& queue, std::uint64_t number, std::int64_t at_ns) {
    ASSERT_TRUE(queue.try_push({.number = number, .action = TakeAction::Start, .at = from_ns(at_ns)}));
  };
  push(channel.orders, 1, 10);
  push(channel.orders, 2, 40);
  push(channel.trigger_orders, 3, 20);
  push(channel.trigger_orders, 4, 30);
  start();
  for (int answers = 0; answers < 2; ++answers) next_answer();  // operators: the first and the last
  disk.request_stop();
  disk.join();

  for (std::uint64_t& number : recorder->followed) number &= 7U;
  EXPECT_EQ(recorder->followed, (std::vector<std::uint64_t>{1, 3, 4, 2}));
}

// The counters of a camera whose channel is new begin at zero.
TEST_F(TakeWorkerTest, CountsWhatFullQueuesDroppedAcrossAChangeOfTheCameras) {
  const auto take_in = [&] {
    std::stop_source ended;
    ended.request_stop();
    worker.run_intake(ended.get_token());
  };
  const auto channel_with = [&](std::uint64_t dropped) {
    auto camera = std::make_unique<CameraChannel>(std::size_t{2}, wake);
    camera->to_take = std::make_unique<SpscQueue<BlobFrame>>(2);
    camera->counters.dropped_take_full.add(dropped);
    return camera;
  };
  const auto first = channel_with(5), second = channel_with(3);
  worker.change({}, {}, {first.get()}, snapshots);
  dropped_sets.add(2);
  take_in();
  take_in();
  EXPECT_EQ(recorder->dropped_images, 5U);
  EXPECT_EQ(recorder->dropped_sets, 2U);

  worker.change({}, {}, {second.get(), first.get()}, snapshots);
  first->counters.dropped_take_full.add(1);
  take_in();

  EXPECT_EQ(recorder->dropped_images, 5U + 3U + 1U);
}

TEST_F(TakeWorkerTest, TellsOfTheEndWithTheDaemon) {
  channel.news_wanted = true;
  start();
  next_news();
  order(channel.orders, 7, TakeAction::Start, "run");
  next_news();
  disk.request_stop();
  disk.join();

  worker.finish();
  worker.tell_changes();

  EXPECT_EQ(next_news().take->state, TakeState::Ended);
}

}  // namespace take_worker_test
}  // namespace mocap::runtime
