#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::wire {

/// Tracks which topics have subscribers, from the messages of an XPUB socket with ZMQ_XPUB_VERBOSE: each subscription
/// to a prefix, and the end of the last subscription to a prefix. Memory is bounded for any input.
class Subscriptions {
 public:
  /// Replaces the list of topics; `wanted` takes an index into this list. Each topic includes its final zero byte.
  void set_topics(std::vector<std::string> topics);

  enum class Verdict { Fine, TooMany, NoSubscription };

  /// Processes one message of the socket: byte 1 (subscribe) or 0 (unsubscribe), then a prefix. `connection` is the
  /// file descriptor of the sender, or -1 if unknown. TooMany: the sender exceeds the limits, and the subscription is
  /// not recorded. The caller should disconnect a sender of TooMany or NoSubscription.
  Verdict take(std::string_view message, int connection);

  /// Resets the rate limit of every connection. Call once a second.
  void refill() { asked_.clear(); }
  /// Resets the rate limit of a connection that ended; a new connection may get its descriptor.
  void forget(int connection) { asked_.erase(connection); }

  /// Returns whether a subscribed prefix matches the topic with this index.
  bool wanted(std::size_t topic) const { return wanted_[topic] > 0; }

  std::size_t count() const { return kept_.size(); }

 private:
  void count_in(std::string_view prefix, int by);
  bool may_add(std::string_view prefix, int connection) const;

  std::vector<std::string> topics_;
  std::vector<int> wanted_;                       // by topic: number of matching prefixes
  std::map<std::string, int, std::less<>> kept_;  // by prefix: connection that subscribed to it first
  std::map<int, std::uint32_t> by_connection_;    // by connection: number of prefixes in kept_
  std::map<int, std::uint32_t> asked_;            // by connection: messages since the last refill
};

}  // namespace mocap::wire
