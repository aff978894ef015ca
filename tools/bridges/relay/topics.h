#pragma once

#include <string>
#include <string_view>

namespace mocap::relay {

/// Whether the text may stand in a NATS subject as the relay's prefix: letters, digits, '-', '_', and dots between
/// them.
bool is_subject_prefix(std::string_view text);

/// Whether `topic` is a topic of the feed, or all topics of a kind: "snapshot", "subject/anna", "lite/*".
bool is_topic(std::string_view topic);

/// The NATS subject of a topic of the feed: mocap.PREFIX.TOPIC. The slash becomes a dot. In the name behind it, each
/// byte but ASCII letters, digits, '-' and '_' becomes %XX, because dots, blanks, '*' and '>' have a meaning in
/// subjects.
std::string subject_of(std::string_view prefix, std::string_view topic);

}  // namespace mocap::relay
