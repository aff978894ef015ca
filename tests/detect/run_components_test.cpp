#include "detect/components/run_components.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "detect/random_bits.h"

namespace mocap::detect {
namespace run_components_test {

constexpr std::uint32_t kAnyArea_px2 = 1'000'000;

// The components of an image that `join` keeps.
RunComponents joined(const BinaryImage& image, std::uint32_t min_area_px2, std::uint32_t max_area_px2,
                     std::size_t max_count) {
  const std::vector<Run> runs = image.runs();
  RunComponents components(runs.size() + 1);
  std::ranges::copy(runs, components.room().begin());
  components.join(runs.size(), min_area_px2, max_area_px2, max_count);
  return components;
}

bool has_runs(RunComponents& components, std::size_t i, const FloodedComponent& expected) {
  return std::ranges::equal(components.runs(i), expected);
}

TEST(RunComponents, AreThoseOfAFloodFill) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 150; ++trial) {
    const BinaryImage image = random_image(random, 1 + static_cast<int>(random() % 200), 40);
    const std::vector<FloodedComponent> expected = flood(image);

    RunComponents components = joined(image, 1, kAnyArea_px2, 1000);

    ASSERT_EQ(components.count(), expected.size()) << trial;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_TRUE(has_runs(components, i, expected[i])) << trial;
      EXPECT_EQ(components.sums(i).n, area_px2(expected[i]));
      EXPECT_EQ(components.first_x(i), expected[i].front().begin);
    }
  }
}

TEST(RunComponents, HaveTheShapeOfTheirPixels) {
  std::mt19937 random(13);
  const BinaryImage image = random_image(random, 150, 40);
  const std::vector<FloodedComponent> expected = flood(image);

  RunComponents components = joined(image, 1, kAnyArea_px2, 1000);

  ASSERT_EQ(components.count(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    double n = 0.0, x_sum = 0.0, y_sum = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
    int begin_x = 1000, end_x = 0;
    for (const detect::Run& run : expected[i]) {
      begin_x = std::min<int>(begin_x, run.begin);
      end_x = std::max<int>(end_x, run.end);
      for (int x = run.begin; x < run.end; ++x) {
        n += 1.0;
        x_sum += x;
        y_sum += run.y;
        xx += x * x;
        yy += run.y * run.y;
        xy += x * run.y;
      }
    }
    const Shape shape = components.shape(i);
    constexpr double kRounding = 1e-6;  // px and px^2
    EXPECT_NEAR(shape.x, x_sum / n, kRounding);
    EXPECT_NEAR(shape.y, y_sum / n, kRounding);
    EXPECT_NEAR(shape.xx, xx / n - x_sum / n * x_sum / n + 1.0 / 12.0, kRounding);
    EXPECT_NEAR(shape.yy, yy / n - y_sum / n * y_sum / n + 1.0 / 12.0, kRounding);
    EXPECT_NEAR(shape.xy, xy / n - x_sum / n * y_sum / n, kRounding);
    EXPECT_EQ(shape.begin_x, begin_x);
    EXPECT_EQ(shape.end_x, end_x);
    EXPECT_EQ(shape.begin_y, expected[i].front().y);
    EXPECT_EQ(shape.end_y, expected[i].back().y + 1);
  }
}

TEST(RunComponents, OutsideTheAreaBoundsAreCountedAndLeftOut) {
  BinaryImage image(100, 20);
  image.add_box(2, 2, 1, 1);
  image.add_box(10, 2, 5, 5);
  image.add_box(20, 2, 30, 10);

  RunComponents components = joined(image, 2, 100, 10);

  ASSERT_EQ(components.count(), 1U);
  EXPECT_EQ(components.sums(0).n, 25);
  EXPECT_EQ(components.too_small(), 1U);
  EXPECT_EQ(components.too_large(), 1U);
  EXPECT_EQ(components.dropped(), 0U);
}

TEST(RunComponents, OverTheirNumberAreTheSmallest) {
  BinaryImage image(100, 40);
  for (int i = 0; i < 8; ++i) image.add_box(12 * i, i % 2 == 0 ? 20 : 5, 1 + (5 * i) % 8, 3);  // widths 1 to 8

  RunComponents components = joined(image, 1, kAnyArea_px2, 3);

  ASSERT_EQ(components.count(), 3U);
  EXPECT_EQ(components.dropped(), 5U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(components.sums(i).n, 3 * 6);
    EXPECT_EQ(components.runs(i).size(), 3U);
  }
  // In the order of their first pixel.
  EXPECT_LE(components.shape(0).begin_y, components.shape(1).begin_y);
  EXPECT_LE(components.shape(1).begin_y, components.shape(2).begin_y);
}

TEST(RunComponents, OfTheLastImageAreForgotten) {
  BinaryImage image(100, 40), next(100, 40);
  image.add_box(2, 2, 1, 1);
  image.add_box(5, 5, 10, 10);
  next.add_box(30, 20, 6, 5);
  RunComponents components = joined(image, 20, kAnyArea_px2, 10);
  ASSERT_EQ(components.runs(0).size(), 10U);
  ASSERT_EQ(components.too_small(), 1U);

  const std::vector<detect::Run> runs = next.runs();
  std::ranges::copy(runs, components.room().begin());
  components.join(runs.size(), 20, kAnyArea_px2, 10);

  ASSERT_EQ(components.count(), 1U);
  EXPECT_EQ(components.too_small(), 0U);
  EXPECT_TRUE(has_runs(components, 0, flood(next)[0]));
  components.join(0, 20, kAnyArea_px2, 10);
  EXPECT_EQ(components.count(), 0U);
}

}  // namespace run_components_test
}  // namespace mocap::detect
