#include "detect/centroid/neighbour_eraser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace mocap::detect {
namespace neighbour_eraser_test {

constexpr std::uint32_t kThreshold = 100;
constexpr int kFirstX = 700, kFirstY = 300;  // position of the box in its image

struct Surroundings {
  int width_px = 0, height_px = 0;
  std::vector<std::uint16_t> pixels;
  std::vector<bool> own;
  std::vector<Run> runs;

  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width_px + x); }
  bool bright(int x, int y) const { return pixels[at(x, y)] >= kThreshold; }
};

/// One or more runs of a component, surrounded by random bright pixels.
Surroundings random_surroundings(std::mt19937& random, int most_px) {
  Surroundings box;
  box.width_px = kBoxStep_px * std::uniform_int_distribution(1, most_px / kBoxStep_px)(random);
  box.height_px = std::uniform_int_distribution(3, most_px)(random);
  std::uniform_int_distribution<int> percent(0, 99), dark(1, 99);
  const int specks = percent(random) / 3;
  for (int i = 0; i < box.width_px * box.height_px; ++i) {
    box.pixels.push_back(static_cast<std::uint16_t>(percent(random) < specks ? 200 : dark(random)));
  }
  box.own.assign(box.pixels.size(), false);
  for (int y = box.height_px / 3; y <= box.height_px / 2; ++y) {
    const int begin = box.width_px / 4 + y % 3, end = std::max(begin + 1, 3 * box.width_px / 4 - y % 5);
    for (int x = begin; x < end; ++x) {
      box.pixels[box.at(x, y)] = 150;
      box.own[box.at(x, y)] = true;
    }
    box.runs.push_back({static_cast<std::uint16_t>(kFirstY + y), static_cast<std::uint16_t>(kFirstX + begin),
                        static_cast<std::uint16_t>(kFirstX + end)});
  }
  return box;
}

/// The oracle: compares the distances of each pixel to all bright pixels in reach.
std::vector<std::uint16_t> erased(const Surroundings& box, int reach) {
  std::vector<std::uint16_t> left = box.pixels;
  const int far = 2 * reach * reach + 1;
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; ++x) {
      int own = far, other = far;
      for (int v = std::max(0, y - reach); v <= std::min(box.height_px - 1, y + reach); ++v) {
        for (int u = std::max(0, x - reach); u <= std::min(box.width_px - 1, x + reach); ++u) {
          if (!box.bright(u, v)) continue;
          int& nearest = box.own[box.at(u, v)] ? own : other;
          nearest = std::min(nearest, (u - x) * (u - x) + (v - y) * (v - y));
        }
      }
      const bool is_other_markers = box.bright(x, y) ? !box.own[box.at(x, y)] : other <= own && other < far;
      if (is_other_markers) left[box.at(x, y)] = 0;
    }
  }
  return left;
}

TEST(NeighbourEraser, RemovesPixelsAtMostAsFarFromANeighbour) {
  std::mt19937 random(3);
  for (const int reach : {1, 2, 3, 8}) {
    NeighbourEraser eraser(reach);
    for (int trial = 0; trial < 30; ++trial) {
      const Surroundings box = random_surroundings(random, trial % 10 == 0 ? kMaxBox_px : 70);
      std::vector<std::uint16_t> pixels = box.pixels;

      eraser.erase(box.runs, kFirstX, kFirstY, kThreshold, {pixels.data(), box.width_px, box.height_px}, pixels);

      ASSERT_EQ(pixels, erased(box, reach)) << "reach " << reach << " trial " << trial;
    }
  }
}

}  // namespace neighbour_eraser_test
}  // namespace mocap::detect
