#include "detect/noise_floor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace mocap::detect {
namespace noise_floor_test {

constexpr int kWidth_px = 1280;
constexpr int kHeight_px = 1024;
constexpr double kTop = 255.0;
constexpr int kScenes = 40;

/// Part of an image that is brighter than the background.
enum class Clutter {
  Textured,   ///< rectangles of one level each, with a texture
  Gradients,  ///< rectangles whose level rises from the background's to 255
  Saturated,  ///< rectangles of level 255
};

struct Scene {
  double background, noise;  // grey levels, true values
  std::vector<std::uint8_t> grey;

  Image image() const {
    Image image;
    image.format = PixelFormat::Mono8;
    image.width_px = kWidth_px;
    image.height_px = kHeight_px;
    image.stride_bytes = kWidth_px;
    image.bytes = std::as_bytes(std::span(grey));
    return image;
  }
};

/// Draws a background with normal noise, and full-height stripes of clutter over the columns in `share` of the image.
Scene draw(std::uint32_t seed, double share, Clutter clutter) {
  std::mt19937 random(seed);
  const auto uniform = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
  Scene scene{uniform(4.0, 40.0), uniform(0.7, 4.0), {}};
  // Independent normal deviates are drawn once and read from random offsets: that is fast, and the image does not
  // repeat within a place.
  std::vector<float> deviates(1 << 16);
  std::normal_distribution<float> normal;
  for (float& one : deviates) one = normal(random);

  struct Stripe {
    bool is_clutter;
    double level, texture;
  };
  // 20 stripes in random order, of which `share` are clutter.
  constexpr int kStripes = 20;
  std::vector<Stripe> stripes(kStripes);
  for (int i = 0; i < kStripes; ++i) {
    stripes[static_cast<std::size_t>(i)] = {i < std::lround(share * kStripes), uniform(80.0, 255.0),
                                            uniform(1.0, 25.0)};
  }
  std::ranges::shuffle(stripes, random);

  constexpr int kStripe_px = kWidth_px / kStripes;
  scene.grey.resize(std::size_t{kWidth_px} * kHeight_px);
  for (int y = 0; y < kHeight_px; ++y) {
    std::size_t next = random() % deviates.size();
    for (int x = 0; x < kWidth_px; ++x) {
      const Stripe& stripe = stripes[static_cast<std::size_t>(x / kStripe_px)];
      double level = scene.background, spread = scene.noise;
      if (stripe.is_clutter && clutter == Clutter::Textured) {
        level = stripe.level;
        spread = stripe.texture;
      } else if (stripe.is_clutter && clutter == Clutter::Gradients) {
        level += (255.0 - level) * y / kHeight_px;
      } else if (stripe.is_clutter) {
        level = 255.0;
        spread = 0.0;
      }
      const double value = level + spread * static_cast<double>(deviates[next++ % deviates.size()]);
      scene.grey[static_cast<std::size_t>(y) * kWidth_px + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
  }
  return scene;
}

NoiseFloor read(const Scene& scene) { return NoiseFloorReader(255).read(scene.image()); }

TEST(NoiseFloor, IsTheMeanAndTheDeviationOfAnImageWithoutClutter) {
  for (std::uint32_t seed = 1; seed <= kScenes; ++seed) {
    const Scene scene = draw(seed, 0.0, Clutter::Textured);

    const NoiseFloor floor = read(scene);

    // 5 standard errors of 512 pixels: 5 / sqrt(512) = 0.22 and 5 / sqrt(1024) = 0.16 of the noise; 0.1 for rounding.
    EXPECT_NEAR(floor.background, scene.background, 0.22 * scene.noise + 0.1) << "seed " << seed;
    EXPECT_NEAR(floor.noise, scene.noise, 0.16 * scene.noise + 0.1) << "seed " << seed;
  }
}

TEST(NoiseFloor, HoldsWithClutterOnSixtyPercentOfTheImage) {
  for (const Clutter clutter : {Clutter::Textured, Clutter::Saturated}) {
    for (std::uint32_t seed = 1; seed <= kScenes; ++seed) {
      const Scene scene = draw(seed, 0.6, clutter);

      const NoiseFloor floor = read(scene);

      // 40 % of 512 pixels are background: 5 standard errors are 0.35 of the noise for the mean. The deviation may be
      // too small by a fifth or too large by a half: the marker threshold stays between 6.4 and 12 deviations.
      EXPECT_NEAR(floor.background, scene.background, 0.35 * scene.noise + 0.1) << "seed " << seed;
      EXPECT_GT(floor.noise, 0.8 * scene.noise - 0.1) << "seed " << seed;
      EXPECT_LT(floor.noise, 1.5 * scene.noise + 0.1) << "seed " << seed;
    }
  }
}

TEST(NoiseFloor, LeavesMarkersVisibleAmongGradients) {
  for (const double share : {0.2, 0.4, 0.6}) {
    for (std::uint32_t seed = 1; seed <= kScenes; ++seed) {
      const Scene scene = draw(seed, share, Clutter::Gradients);

      const NoiseFloor floor = read(scene);

      // The lower end of a gradient cannot be told from the background. The threshold stays above the true noise and in
      // the lower two thirds of the range.
      EXPECT_GT(marker_threshold(floor, kTop), scene.background + 5.0 * scene.noise) << "seed " << seed;
      EXPECT_LT(marker_threshold(floor, kTop), kTop * 2.0 / 3.0) << "share " << share << " seed " << seed;
    }
  }
}

TEST(NoiseFloor, OfAnImageOfOneLevelIsThatLevelWithTheNoiseOfRounding) {
  Scene scene{17.0, 0.0, std::vector<std::uint8_t>(std::size_t{kWidth_px} * kHeight_px, 17)};

  const NoiseFloor floor = read(scene);

  EXPECT_DOUBLE_EQ(floor.background, 17.0);
  EXPECT_DOUBLE_EQ(floor.noise, std::sqrt(1.0 / 12.0));
}

TEST(NoiseFloor, OfADeepFormatIsInItsOwnLevels) {
  std::mt19937 random(3);
  std::normal_distribution<double> level(200.0, 24.0);
  std::vector<std::uint8_t> bytes(std::size_t{kWidth_px} * kHeight_px * 2);
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    // A window in the right half of the image.
    const bool is_window = i / 2 % kWidth_px > kWidth_px / 2;
    const auto value = static_cast<std::uint16_t>(is_window ? 4095 : std::clamp(std::lround(level(random)), 0L, 4095L));
    bytes[i] = static_cast<std::uint8_t>(value & 0xFFU);
    bytes[i + 1] = static_cast<std::uint8_t>(value >> 8U);
  }
  Image image;
  image.format = PixelFormat::Mono12;
  image.width_px = kWidth_px;
  image.height_px = kHeight_px;
  image.stride_bytes = std::size_t{kWidth_px} * 2;
  image.bytes = std::as_bytes(std::span(bytes));

  const NoiseFloor floor = NoiseFloorReader(4095).read(image);

  EXPECT_NEAR(floor.background, 200.0, 0.35 * 24.0);
  EXPECT_NEAR(floor.noise, 24.0, 0.3 * 24.0);
}

}  // namespace noise_floor_test
}  // namespace mocap::detect
