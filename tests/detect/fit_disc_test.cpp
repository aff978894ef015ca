#include "detect/centroid/fit_disc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "detect/blob_detector.h"
#include "scene/render.h"

namespace mocap::detect {
namespace fit_disc_test {

constexpr int kSide = 48;
constexpr double kBackground = 12.0;

struct Look {
  double radius_px, peak, point_spread_px, noise;
};

/// Discs on a grid, each with its own sub-pixel position, drawn by the renderer of the scene; elongated by `motion_px`
/// if that is not zero.
struct Field {
  std::vector<scene::Disc> discs;
  std::vector<std::byte> pixels;
  int width_px = 0, height_px = 0;

  Field(const Look& look, int across, int down, std::uint64_t seed, Eigen::Vector2d motion_px = {0.0, 0.0})
      : width_px(across * kSide), height_px(down * kSide) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> shift(-0.5, 0.5);
    for (int i = 0; i < across * down; ++i) {
      const Eigen::Vector2d at((i % across + 0.5) * kSide + shift(random), (i / across + 0.5) * kSide + shift(random));
      discs.push_back({at - 0.5 * motion_px, at + 0.5 * motion_px, look.radius_px, 1.0});
    }
    scene::ImageSettings settings;
    settings.peak_grey = look.peak;
    settings.point_spread_px = look.point_spread_px;
    settings.background_grey = kBackground;
    settings.read_noise_grey = look.noise;
    settings.electrons_per_grey = 0.0;
    settings.seed = seed;
    pixels.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
    scene::Renderer(width_px, height_px, settings, 0).render(discs, seed, pixels);
  }

  Detection detected() const {
    const auto detector = std::move(make_blob_detector({}, PixelFormat::Mono8, width_px, height_px)).value();
    return detector->detect({pixels, static_cast<std::size_t>(width_px), width_px, height_px, PixelFormat::Mono8});
  }
};

struct Score {
  double rms_px = 0.0, sigma_px = 0.0;  // each axis
  int blobs = 0, found = 0;
};

Score score(const Field& field) {
  Score score;
  const Detection detection = field.detected();
  score.blobs = static_cast<int>(detection.blobs.size());
  for (const scene::Disc& disc : field.discs) {
    const Eigen::Vector2d middle = 0.5 * (disc.begin_px + disc.end_px);
    for (const Blob& blob : detection.blobs) {
      const double error2 = (blob.centroid.v - middle).squaredNorm();
      if (error2 > 1.0) continue;
      score.rms_px += 0.5 * error2;
      score.sigma_px += blob.sigma_px * blob.sigma_px;
      ++score.found;
    }
  }
  score.rms_px = std::sqrt(score.rms_px / score.found);
  score.sigma_px = std::sqrt(score.sigma_px / score.found);
  return score;
}

// The bounds are Cramer-Rao bounds, as mocap-bench detect computes them from the slopes of the exact image.
// Factor 1.15: 400 blobs with two axes give the rms to 2.5 %, and the goal is 1.10.
TEST(Centroids, ComeCloseToTheCramerRaoBound) {
  struct Case {
    Look look;
    double bound_px;
  };
  for (const auto& [look, bound_px] : {Case{{2.0, 200.0, 0.5, 3.0}, 0.0089}, Case{{4.0, 200.0, 0.5, 3.0}, 0.0061},
                                       Case{{8.0, 200.0, 0.5, 3.0}, 0.0043}, Case{{1.5, 200.0, 0.5, 3.0}, 0.0107},
                                       Case{{1.0, 200.0, 0.7, 3.0}, 0.0204}, Case{{4.0, 200.0, 1.0, 3.0}, 0.0084}}) {
    const Score seen = score(Field(look, 20, 20, 71));

    ASSERT_EQ(seen.found, 400);
    EXPECT_LT(seen.rms_px, 1.15 * bound_px) << look.radius_px << " " << look.point_spread_px;
    EXPECT_NEAR(seen.sigma_px / seen.rms_px, 1.0, 0.2) << look.radius_px << " " << look.point_spread_px;
  }
}

// Discs this small have no plateau: weights that include the dark pixels around the disc doubled the error. The bounds
// are the errors of linear weights above twice the noise.
TEST(Centroids, OfTheSmallestDiscsAreBetterThanWithLinearWeights) {
  for (const auto& [look, linear_px] :
       {std::pair{Look{1.0, 218.0, 0.5, 2.0}, 0.0135}, std::pair{Look{1.5, 218.0, 0.5, 2.0}, 0.0088},
        std::pair{Look{1.5, 218.0, 0.3, 2.0}, 0.0068}, std::pair{Look{2.0, 218.0, 0.2, 2.0}, 0.0067}}) {
    EXPECT_LT(score(Field(look, 20, 20, 72)).rms_px, linear_px) << look.radius_px << " " << look.point_spread_px;
  }
}

// Cramer-Rao bounds of the saturated image. Factor 1.3: the goal is 1.5, and without a fit the factor exceeds 4.
TEST(Centroids, OfSaturatedDiscsComeCloseToTheirCramerRaoBound) {
  struct Case {
    Look look;
    double bound_px;
  };
  for (const auto& [look, bound_px] : {Case{{2.0, 260.0, 0.5, 3.0}, 0.00688}, Case{{4.0, 300.0, 0.5, 3.0}, 0.00428},
                                       Case{{8.0, 400.0, 0.5, 3.0}, 0.00261}, Case{{3.0, 600.0, 0.5, 3.0}, 0.00371},
                                       Case{{5.0, 800.0, 0.5, 3.0}, 0.00273}, Case{{4.0, 500.0, 1.0, 3.0}, 0.00448}}) {
    const Score seen = score(Field(look, 11, 11, 73));

    ASSERT_EQ(seen.found, 121);
    EXPECT_LT(seen.rms_px, 1.3 * bound_px) << look.radius_px << " " << look.peak << " " << look.point_spread_px;
    // 121 blobs with two axes give the ratio to 5 %.
    EXPECT_NEAR(seen.sigma_px / seen.rms_px, 1.0, 0.25) << look.radius_px << " " << look.peak;
  }
}

TEST(Centroids, OfElongatedDiscsAreNotSplitAndHaveACorrectSigma) {
  for (const double peak : {200.0, 700.0}) {
    const Score seen = score(Field({4.0, peak, 0.5, 3.0}, 11, 11, 74, {4.0, 2.5}));

    EXPECT_EQ(seen.blobs, 121) << "a disc in motion was split";
    EXPECT_LT(seen.rms_px, 0.03);
    EXPECT_GT(seen.sigma_px, 0.8 * seen.rms_px);
    EXPECT_LT(seen.sigma_px, 4.0 * seen.rms_px);
  }
}

TEST(FitDisc, RefusesABarAndAnEmptyBox) {
  std::vector<std::uint16_t> pixels(48 * 48, 12);
  const Box box{pixels.data(), 48, 48};
  const SoftDisc start{24.0, 24.0, 5.0, 0.6, 300.0};
  EXPECT_FALSE(fit_disc(box, 48, {255, 12.0, 3.0}, start));

  for (int i = 0; i < 30 * 6; ++i) pixels[static_cast<std::size_t>((21 + i / 30) * 48 + 9 + i % 30)] = 255;
  EXPECT_FALSE(fit_disc(box, 48, {255, 12.0, 3.0}, start));
}

TEST(FitDisc, FindsADiscWithoutNoise) {
  const Field field({5.0, 400.0, 0.5, 0.0}, 1, 1, 3);
  std::vector<std::uint16_t> pixels;
  for (const std::byte pixel : field.pixels) pixels.push_back(std::to_integer<std::uint16_t>(pixel));
  const Eigen::Vector2d truth = field.discs[0].begin_px;

  const auto fitted = fit_disc({pixels.data(), kSide, kSide}, kSide, {255, kBackground, 0.3},
                               {truth.x() + 0.3, truth.y() - 0.3, 5.3, 0.58, 300.0});

  ASSERT_TRUE(fitted);
  // Rounding to whole levels is a noise of 0.3 levels, and the model differs slightly from the rendered disc.
  EXPECT_NEAR(fitted->disc.x, truth.x(), 0.01);
  EXPECT_NEAR(fitted->disc.y, truth.y(), 0.01);
  EXPECT_NEAR(fitted->disc.radius_px, 5.0, 0.1);
}

}  // namespace fit_disc_test
}  // namespace mocap::detect
