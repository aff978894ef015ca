#include "associate/rays/ray_bins.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "associate/rays/listed_rays.h"

namespace mocap::associate {
namespace ray_bins_test {

constexpr float kSigmas = 4.0F;
constexpr float kUsual = 0.01F * 0.01F;

/// Rays over a whole image from top to bottom. One ray in ten is much less certain than the others.
struct Image {
  explicit Image(std::size_t count, float uncertain = 0.03F) {
    std::mt19937 random{7};
    std::uniform_real_distribution<float> place(-0.8F, 0.8F), share(0.0F, 1.0F);
    for (std::size_t i = 0; i < count; ++i) {
      x.push_back(place(random));
      y.push_back(place(random));
      const float sigma = share(random) < 0.1F ? uncertain : 0.005F;
      variance.push_back(sigma * sigma);
    }
    std::ranges::sort(y);
    const auto [left, right] = std::ranges::minmax(x);
    bounds = {left, right, y.front(), y.back(), std::ranges::max(variance)};
  }

  RayPlaces places() const { return {x, y, variance}; }
  /// Whether the gate of a position with standard deviation `sigma` contains the ray.
  bool has(std::size_t ray, float at_x, float at_y, float sigma) const {
    const float half = kSigmas * std::sqrt(sigma * sigma + variance[ray]);
    return std::abs(x[ray] - at_x) < half && std::abs(y[ray] - at_y) < half;
  }

  std::vector<float> x, y, variance;
  RayBounds bounds;
};

RayBins::Gate gate_of(const RayBins& bins, float x, float y, float sigma) {
  const auto& [min_x, min_y, per_x, per_y, last] = bins.scale();
  const float half = kSigmas * std::sqrt(sigma * sigma + bins.variance());
  const auto bin = [most = last](float at) { return static_cast<std::size_t>(std::clamp(at, 0.0F, most)); };
  return {bin((x - half - min_x) * per_x - RayBins::kRounding),
          bin((x + half - min_x) * per_x + RayBins::kRounding + 1.0F),
          bin((y - half - min_y) * per_y - RayBins::kRounding),
          bin((y + half - min_y) * per_y + RayBins::kRounding + 1.0F)};
}

TEST(RayBins, MissNoRayInAGate) {
  for (const std::size_t count : {1U, 40U, 64U, 65U, 130U, 300U, 512U}) {
    const Image image(count);
    const auto bins = std::make_unique<RayBins>();
    bins->fill(image.places(), image.bounds, kUsual, kSigmas);
    std::mt19937 random{count};
    std::uniform_real_distribution<float> place(-0.9F, 0.9F);

    for (int i = 0; i < 300; ++i) {
      const float x = place(random), y = place(random), sigma = 0.01F;
      std::set<std::size_t> found;
      bins->visit_rays(gate_of(*bins, x, y, sigma), [&](std::size_t ray) { found.insert(ray); });
      for (std::size_t ray = 0; ray < count; ++ray) {
        EXPECT_TRUE(!image.has(ray, x, y, sigma) || found.contains(ray)) << count << " rays, " << ray;
      }
      if (bins->has_one_word()) {
        std::size_t bits = 0;
        for (const std::size_t ray : found) bits |= std::size_t{1} << ray;
        EXPECT_EQ(bins->only_word_of(gate_of(*bins, x, y, sigma)), bits);
      }
    }
  }
}

TEST(RayBins, KeepGatesNarrowDespiteAFewUncertainRays) {
  const Image image(300, 0.05F);
  const auto bins = std::make_unique<RayBins>(), wide_gates = std::make_unique<RayBins>();
  bins->fill(image.places(), image.bounds, kUsual, kSigmas);
  wide_gates->fill(image.places(), image.bounds, image.bounds.max_variance, kSigmas);
  const auto visited = [](const RayBins& of) {
    std::size_t count = 0;
    for (float x = -0.8F; x < 0.8F; x += 0.05F) {
      of.visit_rays(gate_of(of, x, 0.5F * x, 0.01F), [&](std::size_t) { ++count; });
    }
    return count;
  };

  EXPECT_LT(2 * visited(*bins), visited(*wide_gates));
}

TEST(ListedRays, VisitRaysFromTheBinsAndRaysAddedLater) {
  const Image image(100);
  const auto rays = std::make_unique<ListedRays>();
  const auto place = [&](std::size_t ray) {
    return ListedRays::Place{image.x[ray], image.y[ray], image.variance[ray]};
  };
  for (const std::size_t ray : {3U, 20U, 41U, 60U, 77U, 98U}) rays->add(ray, place(ray));
  rays->bin(image.bounds, kUsual, kSigmas);
  rays->add(50, place(50));

  std::set<std::size_t> found;
  rays->visit({0, static_cast<std::size_t>(rays->scale().bins), 0, static_cast<std::size_t>(rays->scale().bins)},
              [&](std::size_t ray, const ListedRays::Place& at) {
                found.insert(ray);
                EXPECT_EQ(at.x, image.x[ray]);
                EXPECT_EQ(at.variance, image.variance[ray]);
              });

  EXPECT_EQ(found, (std::set<std::size_t>{3, 20, 41, 50, 60, 77, 98}));
  EXPECT_TRUE(rays->has(50));
  EXPECT_FALSE(rays->has(51));
  rays->clear();
  EXPECT_FALSE(rays->has(50));
  rays->add_all(image.places());
  EXPECT_TRUE(rays->has(0) && rays->has(99));
}

}  // namespace ray_bins_test
}  // namespace mocap::associate
