#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace mocap::bench {

struct SolveBenchSettings {
  int subjects = 1;
  int sets = 1200;  ///< number of measured sets, after the T-pose and one second of walking
  double rate_hz = 120.0;
  std::filesystem::path marker_set;  ///< of each person
  std::uint64_t seed = 1;
};

/// CPU time of labelling and solving for one set in one thread, including the solver's prediction for the next set,
/// without the earlier steps of the pipeline.
struct SolveBenchFigures {
  int subjects = 0;
  int markers = 0;
  double median_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
  double p99_over_median = 0.0;
  double label_us = 0.0;       ///< median of the labeller alone
  double solve_us = 0.0;       ///< median of the solver alone
  double ceres_us = 0.0;       ///< median of the reference: poses of the same bodies by Ceres, from the true markers
  double ceres_rms_mm = 0.0;   ///< largest marker rms of a pose by Ceres; shows whether Ceres converged
  double speedup_ceres = 0.0;  ///< ceres_us / solve_us
  double right_share = 0.0;    ///< share of the visible markers that have the right label
  double tracked_share = 0.0;  ///< share of sets and subjects with a complete skeleton
};

/// Fails if the marker set cannot be read.
Result<SolveBenchFigures> run_solve_bench(const SolveBenchSettings& settings);

}  // namespace mocap::bench
