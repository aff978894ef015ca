#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace mocap::paper_study {

/// Time of the tracking steps for one frame, ms: predict, gate, assign, update.
struct CostFigures {
  double p5_ms = 0.0;
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double max_ms = 0.0;
};

struct CostRow {
  int markers = 0;
  CostFigures cost;
  bool kept_all = true;  ///< every marker has the same track id in the first timed frame and in the last frame
};

struct MethodCost {
  std::string method;  ///< a name of methods(), or "cv_kalman" for the reference
  std::vector<CostRow> rows;
};

struct CostSettings {
  std::vector<int> markers{1, 5, 10, 15, 20, 25, 30, 100, 300, 1000};
  int frames = 200;
};

/// Measures every method with markers on small, well separated circles. Images have 640x480 px for up to 30 markers,
/// and are larger for more markers so that the density stays equal. Calls `progress` with the number of finished rows.
std::vector<MethodCost> measure_costs(const CostSettings& settings, const std::function<void(int done)>& progress);
int cost_rows(const CostSettings& settings);

CostFigures cost_of(std::vector<double> times_ms);

}  // namespace mocap::paper_study
