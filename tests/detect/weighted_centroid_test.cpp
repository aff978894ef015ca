#include "detect/centroid/weighted_centroid.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

namespace mocap::detect {
namespace {

/// Sums as of a disc, and of what is none.
Light random_light(std::mt19937& random) {
  const auto up_to = [&random](int most) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint32_t>(most + 1));
  };
  Light light;
  light.middle_x = static_cast<int>(up_to(1000));
  light.middle_y = static_cast<int>(up_to(1000));
  light.width_px = light.height_px = 16;
  light.bright = static_cast<std::uint32_t>(4 + up_to(100));
  light.peak = 200;
  light.span = static_cast<std::uint32_t>(1 + up_to(200));
  light.roundness = 0.01 * static_cast<double>(up_to(100));
  for (int power = 0; power < kPowers; ++power) {
    light.sums.weight[power] = (power == 0 ? 1 : 0) + up_to(kFullWeight * 80 / (power + 1));
    light.sums.x[power] = up_to(40000) - 20000;
    light.sums.y[power] = up_to(40000) - 20000;
  }
  light.sums.slope2 = up_to(40000);
  return light;
}

bool same_bits(const WeighedLight& a, const WeighedLight& b) {
  const auto figures = [](const WeighedLight& each) {
    return std::array{each.blob.centroid.v.x(), each.blob.centroid.v.y(), each.blob.sigma_px,
                      each.blob.area_px2,       each.blob.peak,           each.blob.saturated,
                      each.blob.roundness,      each.radius_px,           each.edge_px};
  };
  const auto of_a = figures(a), of_b = figures(b);
  return std::memcmp(of_a.data(), of_b.data(), sizeof(of_a)) == 0;
}

TEST(WeighLight, TellsABlobTheSameWhateverIsBesideIt) {
  std::mt19937 random(1);
  const Cut cut{40, 255, 12.0, 3.0, std::nullopt};
  for (std::size_t count = 1; count <= kLightsAtOnce; ++count) {
    std::array<Light, kLightsAtOnce> lights;
    for (Light& light : lights) light = random_light(random);
    std::array<WeighedLight, kLightsAtOnce> found;

    tell_blobs(cut, std::span(lights).first(count), found);

    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_TRUE(same_bits(found[i], tell_blob(cut, lights[i]))) << count << " lights, the " << i << "th";
    }
  }
}

}  // namespace
}  // namespace mocap::detect
