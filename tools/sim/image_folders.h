#pragma once

#include <filesystem>

#include "base/result.h"
#include "scene/volume.h"
#include "truth_file.h"

namespace mocap::sim {

/// Writes `<folder>/<camera>/<number>.pgm` and `timestamps.csv` for `seconds` of the motion, and the truth of the same
/// instants. Image n is exposed n periods after `kFolderEpoch`. Fails with Io and the path of the file.
Status write_folders(const std::filesystem::path& folder, const scene::Volume& volume, double rate_hz, double seconds,
                     TruthFile& truth);

/// The instant of image 0 in image folders and the start of the motion.
inline constexpr Timestamp kFolderEpoch = from_ns(1'000'000'000);

}  // namespace mocap::sim
