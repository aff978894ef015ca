#include "detect/components/component_walker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "detect/random_bits.h"

namespace mocap::detect {
namespace component_walker_test {

constexpr std::size_t kManyRuns = 20'000;

// Whether a component has one run in each of its rows.
bool has_one_run_a_row(const FloodedComponent& component) {
  for (std::size_t i = 1; i < component.size(); ++i) {
    if (component[i].y == component[i - 1].y) return false;
  }
  return true;
}

// Whether the walker promises to find a component: one run in each of at most 128 rows, from 23 pixels to the left of
// its first pixel to 102 pixels to the right.
bool is_promised(const FloodedComponent& component) {
  const int x = component[0].begin;
  return has_one_run_a_row(component) && component.size() <= 128 &&
         std::ranges::all_of(component, [&](const Run& run) { return run.begin >= x - 23 && run.end <= x + 103; });
}

struct Walk {
  explicit Walk(const BinaryImage& image) : walker(image.width_px, image.height_px, kManyRuns), words(image.words()) {}

  ComponentWalker::Walked walk(std::uint32_t min_area_px2, std::size_t max_runs = kManyRuns) {
    walker.draw(words);
    walker.begin_image();
    return walker.walk(words, min_area_px2, max_runs);
  }
  bool finds(const FloodedComponent& component) {
    return std::ranges::any_of(
        walker.found(), [&](const PlainComponent& one) { return std::ranges::equal(walker.runs(one), component); });
  }

  ComponentWalker walker;
  std::vector<BrightWord> words;
};

// The pixels of words that are left in the bit image.
int pixels_of(std::span<const BrightWord> words) {
  int pixels = 0;
  for (const BrightWord& word : words) pixels += std::popcount(word.bits);
  return pixels;
}

TEST(ComponentWalker, FindsTheComponentsWithOneRunARowAndLeavesTheOthers) {
  std::mt19937 random(14);
  std::size_t found_components = 0, others = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const BinaryImage image = random_image(random, 1 + static_cast<int>(random() % 300), 60);
    Walk given(image);

    const auto walked = given.walk(1);

    int left_px = 0;
    for (const FloodedComponent& component : flood(image)) {
      const bool is_found = given.finds(component);
      EXPECT_EQ(is_found, is_promised(component)) << trial << ": " << component[0].begin << ", " << component[0].y;
      left_px += is_found ? 0 : area_px2(component);
      ++(is_found ? found_components : others);
    }
    EXPECT_EQ(pixels_of(walked.left), left_px) << trial;
    EXPECT_TRUE(walked.unread.empty());
    EXPECT_EQ(given.walker.too_small(), 0U);
  }
  EXPECT_GT(found_components, 1000U);
  EXPECT_GT(others, 100U);
}

TEST(ComponentWalker, SumsUpTheRunsOfAComponent) {
  std::mt19937 random(15);
  const BinaryImage image = random_image(random, 250, 60);
  Walk given(image);

  given.walk(1);

  ASSERT_FALSE(given.walker.found().empty());
  int last_y = 0;
  for (const PlainComponent& component : given.walker.found()) {
    const auto runs = given.walker.runs(component);
    RunSums sums{.begin_x = runs[0].begin, .begin_y = runs[0].y};
    for (const detect::Run& run : runs) sums.add(run);
    const RunSums& seen = component.sums;
    EXPECT_EQ(seen.n, sums.n);
    EXPECT_EQ(seen.x, sums.x);
    EXPECT_EQ(seen.y, sums.y);
    EXPECT_EQ(seen.xx, sums.xx);
    EXPECT_EQ(seen.yy, sums.yy);
    EXPECT_EQ(seen.xy, sums.xy);
    EXPECT_EQ(seen.cubes, sums.cubes);
    EXPECT_EQ(seen.begin_x, sums.begin_x);
    EXPECT_EQ(seen.end_x, sums.end_x);
    EXPECT_EQ(seen.begin_y, sums.begin_y);
    EXPECT_EQ(seen.end_y, sums.end_y);
    EXPECT_EQ(component.first_x, runs[0].begin);
    EXPECT_GE(seen.begin_y, last_y);
    last_y = seen.begin_y;
  }
}

TEST(ComponentWalker, CountsComponentsBelowTheLeastArea) {
  std::mt19937 random(16);
  for (int trial = 0; trial < 50; ++trial) {
    const BinaryImage image = random_image(random, 1 + static_cast<int>(random() % 300), 60);
    constexpr int kLeast_px2 = 4;
    Walk given(image);

    given.walk(kLeast_px2);

    std::size_t too_small = 0;
    for (const FloodedComponent& component : flood(image)) {
      if (!is_promised(component)) continue;
      const bool is_small = area_px2(component) < kLeast_px2;
      too_small += is_small ? 1 : 0;
      EXPECT_NE(given.finds(component), is_small);
    }
    EXPECT_EQ(given.walker.too_small(), too_small) << trial;
  }
}

TEST(ComponentWalker, FollowsComponentsUpToItsBoundsOverTheBorderOfWords) {
  BinaryImage image(400, 200);
  image.add_box(60, 10, 100, 3);   // over two borders of words, as wide as usual
  image.add_box(250, 20, 3, 128);  // as high as promised
  image.add_box(300, 20, 3, 129);  // too high
  Walk given(image);

  const auto walked = given.walk(1);

  EXPECT_EQ(given.walker.found().size(), 2U);
  EXPECT_EQ(pixels_of(walked.left), 3 * 129);
}

TEST(ComponentWalker, ClearsTheWordsBeyondTheBoundOfItsRuns) {
  BinaryImage image(300, 100);
  for (int y = 0; y < 100; y += 2) {
    for (int x = 0; x < 300; x += 3) image.set(x, y);
  }
  Walk given(image);
  constexpr std::size_t kFew = 120;

  const auto walked = given.walk(1, kFew);

  EXPECT_FALSE(walked.unread.empty());
  EXPECT_GE(given.walker.found().size(), kFew);
  EXPECT_LE(given.walker.found().size(), kFew + 64);  // the rest of the last word
  // Nothing of this image is left for the next one.
  given.walker.wipe(walked.left);
  BinaryImage next(300, 100);
  next.add_box(20, 80, 4, 4);
  given.words = next.words();
  EXPECT_TRUE(given.walk(1).left.empty());
  ASSERT_EQ(given.walker.found().size(), 1U);
  EXPECT_EQ(given.walker.found()[0].sums.n, 16);
}

}  // namespace component_walker_test
}  // namespace mocap::detect
