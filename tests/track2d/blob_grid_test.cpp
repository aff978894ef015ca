#include "track2d/blob_grid.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace mocap::track2d {
namespace blob_grid_test {

std::set<std::uint32_t> near(const BlobGrid& grid, const Eigen::Vector2d& centre, double reach) {
  std::set<std::uint32_t> found;
  grid.for_each_near(centre, reach, [&](std::uint32_t index, double distance2) {
    EXPECT_TRUE(found.insert(index).second) << "twice";
    EXPECT_LE(distance2, reach * reach);
  });
  return found;
}

TEST(BlobGrid, FindsTheSameBlobsAsASearchOfAllBlobs) {
  std::mt19937 random(5);
  BlobGrid grid(600);
  for (const std::size_t count : {0U, 1U, 6U, 7U, 30U, 600U}) {
    for (const double height : {480.0, 3.0, 0.0}) {  // an area, a strip, a line
      std::uniform_real_distribution<double> x(-100.0, 540.0);
      std::uniform_real_distribution<double> y(0.0, height + 1e-9);
      std::vector<BlobGrid::Entry> entries;
      for (std::uint32_t i = 0; i < count; ++i) entries.push_back({x(random), height > 0.0 ? y(random) : 7.0, i});
      grid.build(entries);
      for (int trial = 0; trial < 50; ++trial) {
        const Eigen::Vector2d centre(1.5 * x(random), 1.5 * y(random));
        const double reach = trial % 10 == 0 ? 1e7 : 2.0 * (trial % 40);

        std::set<std::uint32_t> expected;
        for (const auto& entry : entries) {
          if ((Eigen::Vector2d(entry.x, entry.y) - centre).squaredNorm() <= reach * reach) expected.insert(entry.index);
        }

        EXPECT_EQ(near(grid, centre, reach), expected);
      }
    }
  }
}

TEST(BlobGrid, FindsBlobsThatAreAllAtOnePosition) {
  BlobGrid grid(100);
  const std::vector<BlobGrid::Entry> entries(100, {3.0, 4.0, 0});
  std::vector<BlobGrid::Entry> numbered = entries;
  for (std::uint32_t i = 0; i < 100; ++i) numbered[i].index = i;
  grid.build(numbered);

  EXPECT_EQ(near(grid, {3.0, 4.0}, 0.5).size(), 100U);
  EXPECT_TRUE(near(grid, {3.0, 5.0}, 0.5).empty());
}

}  // namespace blob_grid_test
}  // namespace mocap::track2d
