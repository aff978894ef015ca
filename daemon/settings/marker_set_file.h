#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/skeleton.h"

namespace mocap::settings {

/// Reads a marker set (config/markersets) and the skeleton it names, whose path is taken from the marker set file's
/// own folder. `asymmetric` in it names pairs of markers that on purpose are no mirror images of each other
/// (body/asymmetry.h): pairs that nearly are one are refused.
///
/// Fails with NotFound or Io when a file cannot be read, and with InvalidArgument when it says what cannot be: then
/// the message bears all faults of both files, one a line, each as `file:line:column: what is wrong, what was
/// expected`.
Result<MarkerSet> load_marker_set(const std::filesystem::path& file);

/// Reads a skeleton (config/skeletons) alone; fails likewise.
Result<Skeleton> load_skeleton(const std::filesystem::path& file);

}  // namespace mocap::settings
