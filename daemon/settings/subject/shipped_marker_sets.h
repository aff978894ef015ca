#pragma once

#include <vector>

#include "model/skeleton.h"

namespace mocap::settings {

/// The marker sets of the installation, share/mocapd/markersets, by file name. A file that is missing or has faults is
/// left out: the daemon works without it.
std::vector<MarkerSet> load_shipped_marker_sets();

}  // namespace mocap::settings
