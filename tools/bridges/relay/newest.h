#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "wire/zmq_subscriber.h"

namespace mocap::relay {

/// The messages that wait for the server: of each topic only the newest, so that a slow connection delays nothing. Of a
/// topic lite/NAME the newest of each part of the subject's bones. One thread.
class Newest {
 public:
  static constexpr std::size_t kMaxWaiting = 1024;

  struct Message {
    std::string topic;
    std::string payload;
    std::int64_t arrived_ns = 0;
  };

  /// Adds a message. Counts a drop if an older one of its topic waits, which it replaces, or if too many wait.
  void put(wire::FeedMessage message, std::int64_t arrived_ns);

  /// Removes and returns a message: the description first, because the others refer to it, then the topic that has
  /// waited longest. Messages that arrived before `not_before_ns` are dropped: a receiver would take them for live.
  std::optional<Message> take(std::int64_t not_before_ns);

  /// Messages that were dropped. The description, which the feed repeats, does not count.
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::deque<Message> waiting_;
  std::uint64_t dropped_ = 0;
};

}  // namespace mocap::relay
