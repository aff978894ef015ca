#include "runtime/trigger_worker.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <thread>

namespace mocap::runtime {
namespace trigger_worker_test {

constexpr auto kPatience = std::chrono::seconds(60);

// Holds what the worker asked of its parts; the test's thread reads it.
struct World {
  SpscQueue<Datagram> arriving{16};
  SpscQueue<Datagram> sent{16};
  SpscQueue<TakeNews> heard{16};
  std::atomic<std::uint64_t> orders{0};
};

// Wakes when there is news; datagrams of the test come with the same signal.
class ScriptedPort final : public DatagramPort {
 public:
  explicit ScriptedPort(World& world) : world_(world) {}
  std::optional<Datagram> next(int wake, Duration patience) override {
    Datagram datagram;
    if (world_.arriving.try_pop(datagram)) return datagram;
    pollfd wanted{wake, POLLIN, 0};
    ::poll(&wanted, 1, static_cast<int>(patience / std::chrono::milliseconds(1)));
    return std::nullopt;
  }
  void send(const Datagram& datagram) override { static_cast<void>(world_.sent.try_push(datagram)); }

 private:
  World& world_;
};

// Orders a take for each datagram, and sends a datagram for each piece of news.
class ScriptedDesk final : public TriggerDesk {
 public:
  explicit ScriptedDesk(World& world) : world_(world) {}
  TriggerActions receive(const Datagram& datagram, Timestamp) override {
    TriggerActions actions;
    actions.order = TakeOrder{.number = ++world_.orders, .name = datagram.bytes};
    return actions;
  }
  TriggerActions hear(const TakeNews& news, Timestamp) override {
    static_cast<void>(world_.heard.try_push(news));
    TriggerActions actions;
    actions.packets.push_back({0, {}, "heard"});
    actions.lines.push_back({true, "for the log"});
    return actions;
  }

 private:
  World& world_;
};

class TriggerWorkerTest : public testing::Test {
 protected:
  ~TriggerWorkerTest() override {
    thread.request_stop();
    takes.news_came.signal();
  }
  void arrive(const std::string& bytes) {
    ASSERT_TRUE(world.arriving.try_push({0, {}, bytes}));
    takes.news_came.signal();
  }
  template <class Item>
  static std::optional<Item> wait_for(SpscQueue<Item>& queue) {
    Item item;
    for (const Timestamp limit = host_now() + kPatience; host_now() < limit; std::this_thread::yield()) {
      if (queue.try_pop(item)) return item;
    }
    return std::nullopt;
  }

  World world;
  TakeChannel takes;
  TriggerWorker worker{{std::make_unique<ScriptedDesk>(world), std::make_unique<ScriptedPort>(world)}, takes};
  std::jthread thread{[this](const std::stop_token& stop) { worker.run(stop); }};
};

TEST_F(TriggerWorkerTest, PassesOrdersAndSignalsTheDiskThread) {
  const WakeSignal::Ticket before = takes.ordered.ticket();
  arrive("walk");

  const auto order = wait_for(takes.trigger_orders);

  ASSERT_TRUE(order);
  EXPECT_EQ(order->name, "walk");
  for (const Timestamp limit = host_now() + kPatience; takes.ordered.ticket() == before && host_now() < limit;) {
    std::this_thread::yield();
  }
  EXPECT_NE(takes.ordered.ticket(), before);
}

TEST_F(TriggerWorkerTest, SendsWhatTheDeskAnswersToNews) {
  ASSERT_TRUE(takes.news.try_push({3, TakeDone{3, TakeOutcome::Done, "yes"}, TakeHealth{}}));
  takes.news_came.signal();

  const auto sent = wait_for(world.sent);

  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->bytes, "heard");
  EXPECT_EQ(wait_for(world.heard)->order, 3U);
}

TEST_F(TriggerWorkerTest, AnswersForARecorderThatTakesNoOrders) {
  for (int i = 0; i <= 8; ++i) arrive("walk");  // the queue has room for 8

  const auto busy = wait_for(world.heard);

  ASSERT_TRUE(busy && busy->done);
  EXPECT_EQ(busy->order, 9U);
  EXPECT_EQ(busy->done->outcome, TakeOutcome::Failed);
  EXPECT_FALSE(busy->take);
}

TEST_F(TriggerWorkerTest, HearsTheLastNewsBeforeItEnds) {
  ASSERT_TRUE(takes.news.try_push({0, std::nullopt, TakeHealth{}}));
  thread.request_stop();
  takes.news_came.signal();
  thread.join();

  TakeNews news;
  EXPECT_TRUE(world.heard.try_pop(news));
}

}  // namespace trigger_worker_test
}  // namespace mocap::runtime
