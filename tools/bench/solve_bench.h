#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace mocap::bench {

struct SolveBenchSettings {
  int subjects = 1;
  int sets = 1200;  ///< measured, after the T-pose and a second of walking
  double rate_hz = 120.0;
  std::filesystem::path marker_set;  ///< worn by everybody
  std::uint64_t seed = 1;
};

/// What naming and solving cost in one set, in one thread: the labeller's and the solver's share of the row, what the
/// solver foretells for the next set included; not what comes before them. In the thread's own time: what others on the
/// machine take is not in it.
struct SolveBenchFigures {
  int subjects = 0;
  int markers = 0;
  double median_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
  double p99_over_median = 0.0;
  double label_us = 0.0;       ///< median of the labeller alone
  double solve_us = 0.0;       ///< median of the solver alone
  double ceres_us = 0.0;       ///< median of the reference: the same bodies' poses by Ceres, from the true markers
  double ceres_rms_mm = 0.0;   ///< of the worst of its poses: whether it found them
  double speedup_ceres = 0.0;  ///< its median over that of our solver
  double right_share = 0.0;    ///< of the markers in view, those that bore their names
  double tracked_share = 0.0;  ///< of the sets and subjects, those with a whole skeleton
};

/// Fails where the marker set cannot be read.
Result<SolveBenchFigures> run_solve_bench(const SolveBenchSettings& settings);

}  // namespace mocap::bench
