#pragma once

#include <cstddef>
#include <string_view>

namespace mocap::web {

/// Topics of one page: all cameras, all subjects and the topics without a name.
inline constexpr std::size_t kMaxTopics = 96;
/// A topic's length is one byte of the message to the page.
inline constexpr std::size_t kMaxTopic_bytes = 128;

/// Whether a page may subscribe to this topic: one of the feed's topics, or preview/NAME or subject/NAME.
bool is_topic(std::string_view topic);

/// Messages that a page must not miss are queued; of the others only the newest counts.
inline bool is_queued(std::string_view topic) { return topic == "event"; }

}  // namespace mocap::web
