#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"

namespace mocap::sim {

/// Serves the volume's cameras as USB3 Vision cameras, one a USB device controller (dummy_udc.0 and on, as gadgets
/// mocap1, mocap2, ...), until `end` is set or `options.seconds` have passed. Exposures end on whole periods of the
/// host's clock, for all cameras at once; stamps are their begins on it, in ns.
///
/// Fails with Unsupported where the system has no such controllers.
Status serve_usb3(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end);

}  // namespace mocap::sim
