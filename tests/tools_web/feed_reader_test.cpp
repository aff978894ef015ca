#include "web/feed/feed_reader.h"

#include <gmock/gmock.h>

#include <condition_variable>

#include "wire/zmq_publisher.h"

namespace mocap::web {
namespace feed_reader_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

// Publishes a snapshot and health every 2 ms, until destroyed.
class Daemon {
 public:
  Daemon() : publisher_(*wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"})) {
    EXPECT_TRUE(publisher_->describe({}));
    thread_ = std::jthread([this](const std::stop_token& stop) {
      Snapshot snapshot;
      while (!stop.stop_requested()) {
        ++snapshot.number;
        EXPECT_TRUE(publisher_->publish(snapshot));
        EXPECT_TRUE(publisher_->report({}));
        publisher_->serve();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the rate of the feed; the test does not wait here
      }
    });
  }
  const std::string& endpoint() const { return publisher_->endpoint(); }

 private:
  std::unique_ptr<wire::ZmqPublisher> publisher_;
  std::jthread thread_;
};

// Collects the topics that a reader delivers.
class Collector {
 public:
  explicit Collector(const std::string& endpoint, std::vector<std::string> topics) {
    auto opened = FeedReader::open({.endpoint = endpoint, .topics = std::move(topics)}, [this] {
      const std::lock_guard lock(mutex_);
      woken_ = true;
      changed_.notify_one();
    });
    EXPECT_TRUE(opened) << opened.error().message;
    reader_ = *std::move(opened);
  }

  // Waits until `topic` comes; returns the topics that came with it.
  std::vector<std::string> wait_for(const std::string& topic) {
    const auto limit = std::chrono::steady_clock::now() + kLong;
    while (true) {
      std::unique_lock lock(mutex_);
      if (!changed_.wait_until(lock, limit, [this] { return std::exchange(woken_, false); })) return {};
      lock.unlock();
      std::vector<std::string> topics;
      for (const wire::FeedMessage& message : reader_->take()) topics.push_back(message.topic);
      if (std::ranges::find(topics, topic) != topics.end()) return topics;
    }
  }
  FeedReader& reader() { return *reader_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false;
  std::unique_ptr<FeedReader> reader_;
};

TEST(FeedReader, KeepsOneMessageOfEachTopic) {
  const Daemon daemon;
  Collector collector(daemon.endpoint(), {"description", "health", "snapshot"});

  const std::vector<std::string> topics = collector.wait_for("snapshot");

  // ZeroMQ reports the connection on a socket of its own, perhaps after the first message.
  while (!collector.reader().link().connected) ASSERT_FALSE(collector.wait_for("snapshot").empty());
  EXPECT_EQ(std::ranges::count(topics, "snapshot"), 1);
}

TEST(FeedReader, FollowsTheTopicsThatAreWanted) {
  const Daemon daemon;
  Collector collector(daemon.endpoint(), {"health"});
  EXPECT_THAT(collector.wait_for("health"), testing::Not(testing::Contains("snapshot")));

  collector.reader().want({"snapshot"});

  EXPECT_THAT(collector.wait_for("snapshot"), testing::Contains("snapshot"));
}

TEST(FeedReader, RefusesAMalformedEndpoint) {
  EXPECT_EQ(FeedReader::open({.endpoint = "nonsense"}, [] {}).error().code, ErrorCode::InvalidArgument);
}

}  // namespace feed_reader_test
}  // namespace mocap::web
