#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/result.h"
#include "wire/zmq_subscriber.h"

namespace mocap::web {

/// Receives the feed in a thread of its own and keeps the newest message of each topic, and the last 256 events, until
/// take(). It reconnects by itself.
class FeedReader {
 public:
  /// `wake` is called by the reader's thread when messages wait. Fails with InvalidArgument (a malformed endpoint) and
  /// Io.
  static Result<std::unique_ptr<FeedReader>> open(const wire::SubscriberSettings& settings, std::function<void()> wake);
  ~FeedReader();
  FeedReader(const FeedReader&) = delete;
  FeedReader& operator=(const FeedReader&) = delete;

  /// Replaces the list of topics. In force after at most 20 ms.
  void want(std::set<std::string, std::less<>> topics);

  /// Moves all waiting messages out: descriptions first, then events in order, then the others.
  std::vector<wire::FeedMessage> take();

  wire::LinkStatus link() const;

 private:
  FeedReader(std::unique_ptr<wire::ZmqSubscriber> subscriber, std::function<void()> wake);
  void run(const std::stop_token& stop);
  void follow_topics();
  bool receive(Duration patience);

  std::unique_ptr<wire::ZmqSubscriber> subscriber_;  // of the thread
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::vector<std::string> wanted_;  // guarded by mutex_, as all below
  bool topics_changed_ = false;
  std::map<std::string, std::string> newest_;  // payload by topic
  std::deque<std::string> events_;
  wire::LinkStatus link_;
  std::jthread thread_;  // last: stops before the rest is destroyed
};

}  // namespace mocap::web
