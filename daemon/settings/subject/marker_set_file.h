#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/skeleton.h"

namespace mocap::settings {

/// Reads a marker set (config/markersets) and the skeleton that it names; the path of the skeleton is relative to the
/// marker set file. If no such skeleton exists, the path is relative to the shipped marker sets,
/// share/mocapd/markersets. `asymmetric` lists pairs of markers that are no mirror images of each other
/// (identify/asymmetry.h); a pair that nearly is a mirror image is refused.
///
/// Fails with NotFound or Io if a file cannot be read, and with InvalidArgument if a file has faults. The message then
/// lists all faults of both files, one per line: `file:line:column: fault, expectation`.
Result<MarkerSet> load_marker_set(const std::filesystem::path& file);

/// Reads a skeleton (config/skeletons); fails like load_marker_set.
Result<Skeleton> load_skeleton(const std::filesystem::path& file);

}  // namespace mocap::settings
