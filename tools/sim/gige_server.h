#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"
#include "truth_file.h"

namespace mocap::sim {

/// Serves the volume's cameras as GigE Vision cameras, each at its own loopback address, until `end` is set or
/// `options.seconds` have passed. All cameras expose simultaneously: an exposure ends on each whole period of UTC. The
/// time stamp is the start of the exposure in ns of UTC, the frame id is the number of the period (1 to 65535, cyclic).
/// The truth file gets one line for each exposure that at least one camera delivered. Fails with Busy or NotFound if an
/// address cannot be bound, and with Io if the truth file cannot be written.
Status serve_gige(const Options& options, const scene::Volume& volume, TruthFile& truth, const std::atomic<bool>& end);

}  // namespace mocap::sim
