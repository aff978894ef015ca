#pragma once

#include <atomic>
#include <filesystem>

#include "base/result.h"
#include "scene/volume.h"
#include "truth_file.h"

namespace mocap::sim {

/// The images of each camera.
struct ImageSeries {
  double rate_hz = 0.0;
  double seconds = 0.0;
};

/// Writes `<folder>/<camera>/<number>.pgm` and `timestamps.csv` of the series, and the truth of the same
/// instants. Image n is exposed n periods after `kFolderEpoch`. Fails with Io and the path of the file, and with
/// EndOfStream if `end_asked` becomes true: the folders and the truth then have the same number of instants.
Status write_folders(const std::filesystem::path& folder, const scene::Volume& volume, const ImageSeries& series,
                     TruthFile& truth, const std::atomic<bool>& end_asked);

/// Writes the truth alone of the instants that `write_folders` has. Fails with EndOfStream as `write_folders`.
Status write_truth(const ImageSeries& series, TruthFile& truth, const std::atomic<bool>& end_asked);

/// The instant of image 0 in image folders and the start of the motion.
inline constexpr Timestamp kFolderEpoch = from_ns(1'000'000'000);

}  // namespace mocap::sim
