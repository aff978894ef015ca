#include "web/feed/topics.h"

#include <algorithm>
#include <array>

namespace mocap::web {
namespace {

constexpr std::array<std::string_view, 6> kTopics = {"description", "snapshot", "health",
                                                     "event",       "markers",  "sightings"};
constexpr std::array<std::string_view, 2> kNamed = {"preview/", "subject/"};

}  // namespace

bool is_topic(std::string_view topic) {
  if (topic.size() > kMaxTopic_bytes || topic.find('\0') != std::string_view::npos) return false;
  if (std::ranges::find(kTopics, topic) != kTopics.end()) return true;
  return std::ranges::any_of(
      kNamed, [&](std::string_view start) { return topic.starts_with(start) && topic.size() > start.size(); });
}

}  // namespace mocap::web
