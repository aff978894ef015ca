#pragma once

#include "feed.h"

namespace mocap::client {

/// Reads the monotonic clock and UTC, both with a resolution of a microsecond or better.
Now now();

}  // namespace mocap::client
