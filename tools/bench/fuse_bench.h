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
  int sets = 600;                    ///< measured, after a second of warm-up
  std::filesystem::path marker_set;  ///< worn by everybody
};

/// What one set costs on its way from blobs to tracks, in one thread, and how right the markers are.
struct FuseBenchFigures {
  std::string mode;  ///< "predicted": tracks are expected; "cold": nothing is
  int cameras = 0;
  int markers = 0;
  double median_us = 0.0;  ///< align, match, triangulate and track, tracks' prediction included
  double p99_us = 0.0;
  double max_us = 0.0;
  double median_cpu_us = 0.0;  ///< in the thread's own time: what others on the machine take is not in it
  double p99_cpu_us = 0.0;     ///< likewise
  double align_us = 0.0;       ///< median of each part
  double match_us = 0.0;
  double triangulate_us = 0.0;
  double track_us = 0.0;
  double opencv_us = 0.0;        ///< median of the reference
  double speedup_opencv = 0.0;   ///< its median over ours
  double blobs = 0.0;            ///< a set, mean
  double ns_per_blob = 0.0;      ///< median over blobs
  double recall = 0.0;           ///< of markers seen by enough cameras (2 predicted, 3 cold), those within 10 mm
  double ghosts_per_1000 = 0.0;  ///< markers with no true one within 10 mm, in a thousand sets
  double rms_mm = 0.0;           ///< of the markers' distance from the true ones
  double skipped = 0.0;          ///< hypotheses left untried, a set
};

/// Measures both modes on the same sets, predicted first.
Result<std::vector<FuseBenchFigures>> run_fuse_bench(const FuseBenchSettings& settings);

}  // namespace mocap::bench
