#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"

namespace mocap::sim {

/// Serves the volume's cameras as USB3 Vision cameras, each on its own USB device controller (dummy_udc.0, dummy_udc.1,
/// ..., as gadgets mocap1, mocap2, ...), until `end` is set or `options.seconds` have passed. All cameras expose
/// simultaneously; exposures end on whole periods of the host's monotonic clock. A time stamp is the start of the
/// exposure on that clock, ns. Fails with Unsupported if the system lacks these controllers.
Status serve_usb3(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end);

}  // namespace mocap::sim
