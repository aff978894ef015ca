#include "detect/kernels/scalar_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace mocap::detect {
namespace scalar_kernels_test {

constexpr int kWidth_px = 150, kHeight_px = 13;
constexpr std::size_t kStride = 311;

std::vector<std::byte> random_bytes(std::size_t count) {
  std::mt19937 random(6);
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() & 0xFFU);
  return bytes;
}

// The bright pixels of words, as (y, x).
std::set<std::pair<int, int>> pixels_of(const BrightWords& words) {
  std::set<std::pair<int, int>> pixels;
  for (int part = 0; part < BrightWords::kParts; ++part) {
    for (const BrightWord& word : words.part(part)) {
      const int y = words.places().y(word), x = words.places().x(word, y);
      for (int bit = 0; bit < 64; ++bit) {
        if ((word.bits >> bit & 1U) != 0) pixels.emplace(y, x + bit);
      }
    }
  }
  return pixels;
}

TEST(ScalarKernels, ScanTheBytesThatReachTheThreshold) {
  const std::vector<std::byte> bytes = random_bytes(kStride * kHeight_px);
  for (const std::uint32_t threshold : {1U, 200U, 255U}) {
    std::vector<BrightWord> room(BrightWords::room_for(kWidth_px, kHeight_px));
    BrightWords words(room, kWidth_px, kHeight_px);

    scalar_kernels().scan_bytes({bytes.data(), kStride, kWidth_px, kHeight_px, 0, threshold}, words);

    std::set<std::pair<int, int>> expected;
    for (int y = 0; y < kHeight_px; ++y) {
      for (int x = 0; x < kWidth_px; ++x) {
        const auto at = static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x);
        if (std::to_integer<std::uint32_t>(bytes[at]) >= threshold) expected.emplace(y, x);
      }
    }
    EXPECT_EQ(pixels_of(words), expected);
  }
}

TEST(ScalarKernels, ScanTheSignificantBitsOfTwoBytePixels) {
  const std::vector<std::byte> bytes = random_bytes(kStride * kHeight_px);
  constexpr std::uint16_t kTwelveBits = 0x0FFF;
  std::vector<BrightWord> room(BrightWords::room_for(kWidth_px, kHeight_px));
  BrightWords words(room, kWidth_px, kHeight_px);

  scalar_kernels().scan_words({bytes.data(), kStride, kWidth_px, kHeight_px, 0, 3000, kTwelveBits}, words);

  std::set<std::pair<int, int>> expected;
  for (int y = 0; y < kHeight_px; ++y) {
    for (int x = 0; x < kWidth_px; ++x) {
      const auto at = static_cast<std::size_t>(y) * kStride + 2 * static_cast<std::size_t>(x);
      const auto grey = std::to_integer<std::uint32_t>(bytes[at]) + 256 * std::to_integer<std::uint32_t>(bytes[at + 1]);
      if (grey % 4096 >= 3000) expected.emplace(y, x);
    }
  }
  EXPECT_EQ(pixels_of(words), expected);
}

TEST(ScalarKernels, CopyAWindowAndPadItWithZeros) {
  const std::vector<std::byte> bytes = random_bytes(kStride * 10);
  std::vector<std::uint16_t> pixels(32 * 10, 7);
  const Box box{pixels.data(), 32, 10};

  const BoxStatistics seen = scalar_kernels().widen({bytes.data(), kStride, 21}, box, pixels.data(), 128);

  std::uint32_t peak = 0, bright = 0;
  for (std::size_t y = 0; y < 10; ++y) {
    for (std::size_t x = 0; x < 32; ++x) {
      const auto expected = x < 21 ? std::to_integer<std::uint32_t>(bytes[y * kStride + x]) : 0U;
      ASSERT_EQ(pixels[y * 32 + x], expected);
      peak = std::max(peak, expected);
      bright += expected >= 128 ? 1 : 0;
    }
  }
  EXPECT_EQ(seen.peak, peak);
  EXPECT_EQ(seen.bright, bright);
  EXPECT_EQ(scalar_kernels().survey(box, 128).peak, peak);
  EXPECT_EQ(scalar_kernels().survey(box, 128).bright, bright);
}

TEST(ScalarKernels, SumThePowersOfARamp) {
  std::mt19937 random(8);
  constexpr int kSize = 16;
  for (const IntensityRamp ramp : {IntensityRamp{0, 255}, IntensityRamp{20, 100}, IntensityRamp{900, 60000}}) {
    std::vector<std::uint16_t> pixels(kSize * kSize);
    for (std::uint16_t& pixel : pixels) pixel = static_cast<std::uint16_t>(random() % (ramp.low + ramp.span + 50));

    const BoxSums sums = scalar_kernels().weigh({pixels.data(), kSize, kSize}, ramp);

    double weight[kPowers] = {}, x_sum[kPowers] = {}, y_sum[kPowers] = {}, slope2 = 0.0;
    for (int i = 0; i < kSize * kSize; ++i) {
      const double u =
          std::clamp((pixels[static_cast<std::size_t>(i)] - static_cast<double>(ramp.low)) / ramp.span, 0.0, 1.0);
      for (int k = 0; k < kPowers; ++k) {
        weight[k] += std::pow(u, k + 1);
        x_sum[k] += std::pow(u, k + 1) * (i % kSize - kSize / 2);
        y_sum[k] += std::pow(u, k + 1) * (i / kSize - kSize / 2);
      }
      slope2 += std::pow(4.0 * u * (1.0 - u), 2);
    }
    // Each power is rounded down by up to 4 of 2048 units; the lever of a pixel is up to 8 px.
    constexpr double kRounding = 4.0 * kSize * kSize;
    for (int k = 0; k < kPowers; ++k) {
      EXPECT_NEAR(static_cast<double>(sums.weight[k]), kFullWeight * weight[k], kRounding) << "power " << k + 1;
      EXPECT_NEAR(static_cast<double>(sums.x[k]), kFullWeight * x_sum[k], 8.0 * kRounding) << "power " << k + 1;
      EXPECT_NEAR(static_cast<double>(sums.y[k]), kFullWeight * y_sum[k], 8.0 * kRounding) << "power " << k + 1;
    }
    // u (1 - u) has 32 units at u = 1/2 and is rounded to one unit.
    EXPECT_NEAR(static_cast<double>(sums.slope2), kFullSlope * kFullSlope * slope2, 2.0 * kFullSlope * kSize * kSize);
  }
}

TEST(ScalarKernels, SumNothingInADarkBox) {
  const std::vector<std::uint16_t> pixels(16 * 16, 20);

  const BoxSums sums = scalar_kernels().weigh({pixels.data(), 16, 16}, {20, 100});

  EXPECT_EQ(sums.weight[0], 0);
  EXPECT_EQ(sums.slope2, 0);
  EXPECT_EQ(scalar_kernels().survey({pixels.data(), 16, 16}, 21).bright, 0U);
}

TEST(Scale, MapsEachSpanToElevenBitsWithoutOverflow) {
  for (std::uint32_t span = 1; span <= 0xFFFF; ++span) {
    const Scale scale(span);
    const auto u = [&](std::uint32_t grey) { return (grey << scale.shift) * scale.factor >> 16U; };

    ASSERT_LE(span << scale.shift, 0xFFFFU) << span;
    ASSERT_GE(u(span), 2046U) << span;
    ASSERT_LE(u(span), 2047U) << span;
    ASSERT_EQ(u(0), 0U);
    // Half of the span, to two units and the half of a grey level.
    ASSERT_NEAR(u(span / 2), 2047.0 * (span / 2) / span, 2.0) << span;
  }
}

}  // namespace scalar_kernels_test
}  // namespace mocap::detect
