#pragma once

#include <string>

#include "watch/feed_state.h"
#include "wire/zmq_subscriber.h"

namespace mocap::watch {

/// The state of the feed in one line of `columns` characters at most, for people. Where there is no room for the
/// latency of every stage, that of the whole way is told.
std::string status_line(const FeedState& feed, Timestamp now, std::size_t columns);

/// Why no snapshot comes, as far as it can be known from here.
std::string reason_for_silence(const FeedState& feed, const wire::LinkStatus& link, const std::string& endpoint,
                               Duration silent_for);

/// The whole watch as one JSON object in one line.
std::string summary_json(const FeedState& feed, const std::string& endpoint, Duration watched);

}  // namespace mocap::watch
