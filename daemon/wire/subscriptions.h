#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::wire {

/// Which topics somebody listens to, told by what an XPUB socket with ZMQ_XPUB_VERBOSE hands up: every subscription to
/// a prefix, and the end of the last one. Bounded, whoever sends what.
class Subscriptions {
 public:
  /// From now on these topics are asked for, by index. Topics end with their zero byte.
  void set_topics(std::vector<std::string> topics);

  enum class Verdict { Fine, TooMany, NoSubscription };

  /// Takes one message of the socket in: 1 or 0, and a prefix. `connection`: by which it came; -1: not known. TooMany:
  /// that peer asks for more than anybody needs; this is not kept, and it should be cut off, as should who sends what
  /// is no subscription.
  Verdict take(std::string_view message, int connection);

  /// About once a second: everybody may ask for so much again.
  void refill() { asked_.clear(); }
  /// That connection ended; its number may be another's from now on.
  void forget(int connection) { asked_.erase(connection); }

  /// Whether somebody's prefix begins the topic of this index.
  bool wanted(std::size_t topic) const { return wanted_[topic] > 0; }

  std::size_t count() const { return kept_.size(); }

 private:
  void count_in(std::string_view prefix, int by);
  bool has_room(std::string_view prefix, int connection) const;

  std::vector<std::string> topics_;
  std::vector<int> wanted_;                       // prefixes that begin the topic
  std::map<std::string, int, std::less<>> kept_;  // prefix, and the connection that was first to want it
  std::map<int, std::uint32_t> by_connection_;    // how many prefixes each was first to want
  std::map<int, std::uint32_t> asked_;            // messages of each since the last refill
};

}  // namespace mocap::wire
