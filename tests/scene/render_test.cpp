#include "scene/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/random.h"

namespace mocap::scene {
namespace render_test {

constexpr int kSize = 64;

ImageSettings noiseless() {
  ImageSettings settings;
  settings.background_grey = 0.0;
  settings.read_noise_grey = 0.0;
  settings.electrons_per_grey = 0.0;
  return settings;
}

std::vector<std::byte> draw(const ImageSettings& settings, std::span<const Disc> discs, std::uint64_t number = 0) {
  std::vector<std::byte> pixels(kSize * kSize);
  Renderer(kSize, kSize, settings, 0).render(discs, number, pixels);
  return pixels;
}

struct Light {
  double sum = 0.0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
};

Light light_of(const std::vector<std::byte>& pixels) {
  Light light;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double grey = std::to_integer<int>(pixels[static_cast<std::size_t>(y * kSize + x)]);
      light.sum += grey;
      light.centroid += grey * Eigen::Vector2d(x, y);
    }
  }
  light.centroid /= light.sum;
  return light;
}

TEST(Renderer, PutsTheCentroidOfADiscAtItsCentre) {
  Random random(1);
  Eigen::Vector2d bias = Eigen::Vector2d::Zero();
  constexpr int kDiscs = 400;
  for (int i = 0; i < kDiscs; ++i) {
    const Eigen::Vector2d middle(20.0 + 20.0 * random.uniform(), 20.0 + 20.0 * random.uniform());
    const Disc disc{middle, middle, 1.5 + 4.0 * random.uniform(), 1.0};

    const Light light = light_of(draw(noiseless(), std::span(&disc, 1)));

    // The error is rounding to whole grey levels: about 40 pixels with 0.29 levels rms at 4 px from the centre, divided
    // by a sum of 1600 levels.
    EXPECT_LT((light.centroid - middle).norm(), 0.03) << middle.transpose() << " r " << disc.radius_px;
    bias += (light.centroid - middle) / kDiscs;
  }
  EXPECT_LT(bias.norm(), 0.002);
}

TEST(Renderer, DrawsLightInProportionToTheAreaOfADisc) {
  for (const double radius_px : {1.5, 2.5, 6.0}) {
    const Disc disc{{31.3, 30.8}, {31.3, 30.8}, radius_px, 1.0};
    ImageSettings settings = noiseless();

    const Light light = light_of(draw(settings, std::span(&disc, 1)));

    const double expected = settings.peak_grey * std::numbers::pi * radius_px * radius_px;
    EXPECT_NEAR(light.sum / expected, 1.0, 0.006) << radius_px;  // rounding of the faint rim
  }
}

TEST(Renderer, AgreesWithBruteForceSamplingOfDiscAndBlur) {
  const Disc disc{{30.2, 33.7}, {30.2, 33.7}, 2.2, 1.0};
  ImageSettings settings = noiseless();
  const std::vector<std::byte> pixels = draw(settings, std::span(&disc, 1));
  const double s = settings.point_spread_px * std::numbers::sqrt2;
  constexpr int kFine = 200;  // samples of the disc along an axis

  for (int y = 28; y < 40; ++y) {
    for (int x = 25; x < 36; ++x) {
      double sum = 0.0;
      const double step = 2.0 * disc.radius_px / kFine;
      for (int i = 0; i < kFine * kFine; ++i) {
        const Eigen::Vector2d at(-disc.radius_px + (i % kFine + 0.5) * step,
                                 -disc.radius_px + (i / kFine + 0.5) * step);
        if (at.norm() > disc.radius_px) continue;
        const Eigen::Vector2d d = Eigen::Vector2d(x, y) - disc.begin_px - at;
        sum += 0.25 * (std::erf((d.x() + 0.5) / s) - std::erf((d.x() - 0.5) / s)) *
               (std::erf((d.y() + 0.5) / s) - std::erf((d.y() - 0.5) / s)) * step * step;
      }
      const int grey = std::to_integer<int>(pixels[static_cast<std::size_t>(y * kSize + x)]);
      EXPECT_NEAR(grey, settings.peak_grey * sum, 0.6) << x << " " << y;  // rounding, and the sampling's own error
    }
  }
}

TEST(Renderer, SmearsAMovingDiscAroundTheMiddleOfItsPath) {
  const Disc still{{30.0, 30.0}, {30.0, 30.0}, 2.0, 1.0};
  const Disc moving{{26.0, 29.0}, {34.0, 31.0}, 2.0, 1.0};

  const Light sharp = light_of(draw(noiseless(), std::span(&still, 1)));
  const Light smeared = light_of(draw(noiseless(), std::span(&moving, 1)));

  EXPECT_LT((smeared.centroid - still.begin_px).norm(), 0.02);
  EXPECT_NEAR(smeared.sum / sharp.sum, 1.0, 0.01);
}

TEST(Renderer, SaturatesAndIgnoresDiscsThatAreNotFiniteOrTooLarge) {
  const double nan = std::nan("");
  const std::vector<Disc> discs{{{10.0, 10.0}, {10.0, 10.0}, 4.0, 1.0},
                                {{nan, 3.0}, {nan, 3.0}, 2.0, 1.0},
                                {{-900.0, 1e300}, {5.0, 1e300}, 2.0, 1.0},
                                {{0.0, 0.0}, {0.0, 0.0}, 1e9, 1.0},
                                {{63.4, -0.3}, {63.4, -0.3}, 3.0, 1.0}};
  ImageSettings settings;
  settings.peak_grey = 1000.0;

  const std::vector<std::byte> pixels = draw(settings, discs);

  EXPECT_EQ(std::to_integer<int>(pixels[10 * kSize + 10]), 255);
  EXPECT_EQ(std::to_integer<int>(pixels[63]), 255);
}

TEST(Renderer, GivesEqualBytesForEqualSeedAndNumberOnly) {
  const Disc disc{{30.2, 33.7}, {30.4, 33.7}, 2.2, 1.0};
  ImageSettings settings, other;
  other.seed = 2;

  EXPECT_EQ(draw(settings, std::span(&disc, 1), 7), draw(settings, std::span(&disc, 1), 7));
  EXPECT_NE(draw(settings, std::span(&disc, 1), 7), draw(settings, std::span(&disc, 1), 8));
  EXPECT_NE(draw(settings, std::span(&disc, 1), 7), draw(other, std::span(&disc, 1), 7));
}

TEST(Renderer, HasBackgroundNoiseOfTheSettings) {
  ImageSettings settings;
  settings.background_grey = 20.0;
  settings.read_noise_grey = 3.0;

  const std::vector<std::byte> pixels = draw(settings, {});

  double sum = 0.0, squares = 0.0;
  for (const std::byte pixel : pixels) {
    sum += std::to_integer<int>(pixel);
    squares += std::to_integer<int>(pixel) * std::to_integer<int>(pixel);
  }
  const double mean = sum / (kSize * kSize);
  EXPECT_NEAR(mean, 20.0, 0.25);                                                                 // 5 sigma of the mean
  EXPECT_NEAR(std::sqrt(squares / (kSize * kSize) - mean * mean), std::hypot(3.0, 0.29), 0.17);  // 5 sigma
}

}  // namespace render_test
}  // namespace mocap::scene
