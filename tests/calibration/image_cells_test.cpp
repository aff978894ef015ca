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

TEST(ImageCells, CountsRowByRowFromTheTopLeft) {
  EXPECT_EQ(cell_of({0.0, 0.0}, 1280, 1024), 0U);
  EXPECT_EQ(cell_of({1279.0, 0.0}, 1280, 1024), 7U);
  EXPECT_EQ(cell_of({160.0, 128.0}, 1280, 1024), 9U);
  EXPECT_EQ(cell_of({1300.0, 1100.0}, 1280, 1024), 63U) << "outside: the nearest cell";
}

}  // namespace image_cells_test
}  // namespace mocap::calibration
