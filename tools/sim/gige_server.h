#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"
#include "truth_file.h"

namespace mocap::sim {

/// Serves the volume's cameras as GigE Vision cameras, one a loopback address, until `end` is set or
/// `options.seconds` have passed. All expose at the same instants: an exposure ends on each whole period of UTC, its
/// stamp is its begin in ns of UTC, its frame id is the number of the period (from 1 to 65535, over and over). The
/// truth gets one line for each instant at which at least one camera was read out.
///
/// Fails with Busy or NotFound when an address cannot be had, and with Io when the truth cannot be written.
Status serve_gige(const Options& options, const scene::Volume& volume, TruthFile& truth, const std::atomic<bool>& end);

}  // namespace mocap::sim
