#include "wire/subscriptions.h"

#include <algorithm>

namespace mocap::wire {
namespace {

constexpr std::size_t kMostKept = 4096;     // prefixes in all; prefixes of existing topics are added beyond this bound
constexpr std::uint32_t kMostOfOne = 256;   // prefixes of one connection: ten times the topics of 16 subjects
constexpr std::size_t kLongest = 256;       // bytes of a prefix; ZeroMQ keeps a node of a tree for each byte
constexpr std::uint32_t kMostAtOnce = 512;  // messages of one connection in a second

}  // namespace

void Subscriptions::set_topics(std::vector<std::string> topics) {
  topics_ = std::move(topics);
  wanted_.assign(topics_.size(), 0);
  for (const auto& [prefix, connection] : kept_) count_in(prefix, 1);
}

Subscriptions::Verdict Subscriptions::take(std::string_view message, int connection) {
  if (message.empty() || (message[0] != '\0' && message[0] != '\1')) return Verdict::NoSubscription;
  const bool too_fast = connection >= 0 && ++asked_[connection] > kMostAtOnce;
  const std::string_view prefix = message.substr(1);
  const auto found = kept_.find(prefix);
  if (message[0] == '\0') {
    if (found == kept_.end()) return Verdict::Fine;
    const auto owner = by_connection_.find(found->second);
    if (owner != by_connection_.end() && --owner->second == 0) by_connection_.erase(owner);
    count_in(prefix, -1);
    kept_.erase(found);
    return Verdict::Fine;
  }
  if (too_fast) return Verdict::TooMany;
  if (found != kept_.end()) return Verdict::Fine;
  if (!may_add(prefix, connection)) return Verdict::TooMany;
  ++by_connection_[connection];
  kept_.emplace(prefix, connection);
  count_in(prefix, 1);
  return Verdict::Fine;
}

// A prefix of an existing topic is always recorded, whatever its length, or the topic would not be sent. The number of
// such prefixes is the total length of the topics.
bool Subscriptions::may_add(std::string_view prefix, int connection) const {
  const auto own = by_connection_.find(connection);
  if (connection >= 0 && own != by_connection_.end() && own->second >= kMostOfOne) return false;
  if (kept_.size() < kMostKept && prefix.size() <= kLongest) return true;
  return std::ranges::any_of(topics_, [&](const std::string& topic) { return topic.starts_with(prefix); });
}

void Subscriptions::count_in(std::string_view prefix, int by) {
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (std::string_view(topics_[i]).starts_with(prefix)) wanted_[i] += by;
  }
}

}  // namespace mocap::wire
