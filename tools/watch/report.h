#pragma once

#include <cstddef>
#include <string>

#include "watch/feed_state.h"
#include "wire/zmq_subscriber.h"

namespace mocap::watch {

/// The state of the feed in one line of at most `columns` bytes, as cli::shown() makes it. If the line is too short for
/// the latencies of all stages, only the total latency is shown.
std::string status_line(const FeedState& feed, Timestamp now, std::size_t columns);

/// The reason why no snapshot arrives, as far as the client can know it.
std::string reason_for_silence(const FeedState& feed, const wire::LinkStatus& link, const std::string& endpoint,
                               Duration silent_for);

/// A summary of the whole observation as one JSON object in one line.
std::string summary_json(const FeedState& feed, const std::string& endpoint, Duration watched);

}  // namespace mocap::watch
