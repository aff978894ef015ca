#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/fuse_world.h"

namespace mocap::bench {

struct FuseBenchSettings {
  simworld::FuseWorldSettings world;
  int sets = 600;                    ///< number of measured sets, after a warm-up of 1 s
  std::filesystem::path marker_set;  ///< of each person
};

/// Time for one set from blobs to 3D tracks in one thread, and the accuracy of the markers.
struct FuseBenchFigures {
  std::string mode;  ///< "predicted": with predictions of the tracks; "cold": without
  int cameras = 0;
  int markers = 0;
  double median_us = 0.0;  ///< align, match, triangulate and track, including the prediction of the tracks
  double p99_us = 0.0;
  double max_us = 0.0;
  double median_cpu_us = 0.0;  ///< CPU time of the thread
  double p99_cpu_us = 0.0;     ///< CPU time of the thread
  double align_us = 0.0;       ///< median of each part
  double match_us = 0.0;
  double triangulate_us = 0.0;
  double track_us = 0.0;
  double opencv_us = 0.0;       ///< median of the reference
  double speedup_opencv = 0.0;  ///< opencv_us / median_us
  double blobs = 0.0;           ///< mean number in a set
  double ns_per_blob = 0.0;     ///< median_us / blobs
  double recall =
      0.0;  ///< share of the markers seen by enough cameras (2 predicted, 3 cold) with an output within 10 mm
  double ghosts_per_1000 = 0.0;  ///< outputs without a true marker within 10 mm, in 1000 sets
  double rms_mm = 0.0;           ///< distance to the true markers
  double skipped = 0.0;          ///< hypotheses skipped to bound the work, for each set
};

/// Measures both modes on the same sets, predicted first.
Result<std::vector<FuseBenchFigures>> run_fuse_bench(const FuseBenchSettings& settings);

}  // namespace mocap::bench
