#pragma once

#include <filesystem>

#include "base/result.h"
#include "scene/volume.h"
#include "truth_file.h"

namespace mocap::sim {

/// Writes `<folder>/<camera>/<number>.pgm` and `timestamps.csv` for `seconds` of the motion, and the truth of the same
/// instants. Number n is exposed n periods after `kFolderEpoch`. Fails with Io, naming the file.
Status write_folders(const std::filesystem::path& folder, const scene::Volume& volume, double rate_hz, double seconds,
                     TruthFile& truth);

/// The instant of image 0 in image folders; the motion begins there.
inline constexpr Timestamp kFolderEpoch = from_ns(1'000'000'000);

}  // namespace mocap::sim
