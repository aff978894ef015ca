#include "calibration/image_cells.h"

#include <gtest/gtest.h>

#include <array>

namespace mocap::calibration {
namespace image_cells_test {

using Cells = std::array<int, kImageCells * kImageCells>;

TEST(ImageCells, NamesTheRegionWithTheFewestOccupiedCells) {
  Cells cells;
  cells.fill(1);
  for (int y = 6; y < 8; ++y) {
    for (int x = 0; x < 2; ++x) cells[static_cast<std::size_t>(y * kImageCells + x)] = 0;
  }

  EXPECT_EQ(least_covered_region(cells, kImageCells), "the bottom left");
}

TEST(ImageCells, NamesNoRegionIfEveryRegionIsHalfCovered) {
  Cells cells;
  cells.fill(3);
  cells[0] = 0;

  EXPECT_EQ(least_covered_region(cells, kImageCells), "");
}

}  // namespace image_cells_test
}  // namespace mocap::calibration
