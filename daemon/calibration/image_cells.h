#pragma once

#include <cstddef>
#include <string>

#include "model/calibration/calibration_report.h"

namespace mocap::calibration {

/// Coverage of an image is counted in kImageCells x kImageCells cells. Chosen by hand: a cell of a 1280x1024 image is
/// 160x128 px, about the image of a wand at 4 m.
inline constexpr int kImageCells = kCoverageCells;

/// Names the ninth of an image ("the top left") with the smallest fraction of occupied cells; empty if every ninth has
/// at least half of its cells occupied. `cells`: n x n counts, row by row.
std::string least_covered_region(const auto& cells, int n) {
  static constexpr const char* kNames[9] = {"the top left",    "the top",    "the top right",
                                            "the left",        "the middle", "the right",
                                            "the bottom left", "the bottom", "the bottom right"};
  double least = 0.5;
  std::string name;
  for (int region = 0; region < 9; ++region) {
    int occupied = 0;
    int all = 0;
    for (int y = (region / 3) * n / 3; y < (region / 3 + 1) * n / 3; ++y) {
      for (int x = (region % 3) * n / 3; x < (region % 3 + 1) * n / 3; ++x) {
        occupied += cells[static_cast<std::size_t>(y * n + x)] > 0 ? 1 : 0;
        ++all;
      }
    }
    const double fraction = static_cast<double>(occupied) / all;
    if (fraction >= least) continue;
    least = fraction;
    name = kNames[region];
  }
  return name;
}

}  // namespace mocap::calibration
