#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>

namespace mocap::web {

/// A set of topics of the feed.
using Topics = std::set<std::string, std::less<>>;

/// Receives the feed's messages from the Hub, on the thread of the Hub.
class Listener {
 public:
  virtual ~Listener() = default;
  /// Replaces the list of topics. Waiting messages of other topics are discarded.
  virtual void subscribe(Topics topics) = 0;
  virtual const Topics& topics() const = 0;
  /// Keeps `message`, framed() with its topic, if the listener wants its topic.
  virtual void offer(std::string_view topic, const std::shared_ptr<const std::string>& message) = 0;
  /// Snapshots that were replaced before they could be sent.
  virtual std::uint64_t dropped_snapshots() const = 0;

  bool wants(std::string_view topic) const { return topics().contains(topic); }
};

}  // namespace mocap::web
