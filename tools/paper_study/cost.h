#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace mocap::paper_study {

/// What tracking alone takes for one frame, ms: predict, gate, assign, update.
struct CostFigures {
  double p5_ms = 0.0;
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double max_ms = 0.0;
};

struct CostRow {
  int markers = 0;
  CostFigures cost;
  bool kept_all = true;  ///< every marker bore the name in the last frame that it bore in the first timed one
};

struct MethodCost {
  std::string method;  ///< those of methods(), and "cv_kalman", the reference
  std::vector<CostRow> rows;
};

struct CostSettings {
  std::vector<int> markers{1, 5, 10, 15, 20, 25, 30, 100, 300, 1000};
  int frames = 200;
};

/// Times every method on markers on simple ways: small circles, far enough apart. Images have 640x480 px up to 30
/// markers, and so many more for more that markers are as far apart. `progress` is told how many of the methods' rows
/// are done.
std::vector<MethodCost> measure_costs(const CostSettings& settings, const std::function<void(int done)>& progress);
int cost_rows(const CostSettings& settings);

CostFigures cost_of(std::vector<double> times_ms);

}  // namespace mocap::paper_study
