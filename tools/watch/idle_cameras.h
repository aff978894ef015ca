#pragma once

#include <string>

#include "watch/feed_state.h"

namespace mocap::watch {

/// The cameras whose blobs are in no 3D markers although those of the other cameras are, over the time between the last
/// two health reports, with the remedy. Empty if there are none, or before the second report.
std::string idle_cameras(const FeedState& feed);

}  // namespace mocap::watch
