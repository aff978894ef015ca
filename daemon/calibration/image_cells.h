#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bitset>
#include <cstddef>
#include <string>

#include "model/calibration/calibration_report.h"

namespace mocap::calibration {

/// Coverage of an image is counted in kImageCells x kImageCells cells. Chosen by hand: a cell of a 1280x1024 image is
/// 160x128 px, about the image of a wand at 4 m.
inline constexpr int kImageCells = kCoverageCells;

/// Views of markers must cover at least so many cells of an image, or they do not determine the pose of its camera:
/// views at one place leave the rotation about their ray free. Chosen by hand: a person in a T-pose for 6 s covers as
/// many in each image of config/demo.rig.toml (mocap-sim --motion tpose:6).
inline constexpr std::size_t kMinCoveredCells = 8;

/// The cells with a view, row by row.
using CoveredCells = std::bitset<static_cast<std::size_t>(kImageCells* kImageCells)>;

/// The index of the cell of a point in px; a point outside the image belongs to the nearest cell.
inline std::size_t cell_of(const Eigen::Vector2d& at_px, int width_px, int height_px) {
  const auto index = [](double at, int size) {
    return std::clamp(static_cast<int>((at + 0.5) * kImageCells / size), 0, kImageCells - 1);
  };
  return static_cast<std::size_t>(index(at_px.y(), height_px) * kImageCells + index(at_px.x(), width_px));
}

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
