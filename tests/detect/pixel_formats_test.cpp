#include "detect/pixel_rows.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "detect/blob_detector.h"
#include "detect/row_mask.h"

namespace mocap::detect {
namespace pixel_formats_test {

struct Bits {
  std::vector<std::uint8_t> bytes;
  void set(std::size_t bit, std::uint32_t count, std::uint32_t value) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::size_t at = bit + i;
      if (bytes.size() <= at / 8) bytes.resize(at / 8 + 1);
      bytes[at / 8] = static_cast<std::uint8_t>(bytes[at / 8] | (value >> i & 1U) << at % 8);
    }
  }
};

/// Writes the pixels bit by bit as the standards define the formats, without gaps between pixels.
std::vector<std::uint8_t> packed(PixelFormat format, const std::vector<std::uint32_t>& values) {
  Bits bits;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t pair = i / 2 * 24;
    const bool second = i % 2 == 1;
    switch (format) {
      case PixelFormat::Mono10p: bits.set(i * 10, 10, values[i]); break;
      case PixelFormat::Mono12p: bits.set(i * 12, 12, values[i]); break;
      case PixelFormat::Mono10Packed:
        bits.set(pair + (second ? 16 : 0), 8, values[i] >> 2U);
        bits.set(pair + (second ? 12 : 8), 2, values[i] & 3U);
        break;
      case PixelFormat::Mono12Packed:
        bits.set(pair + (second ? 16 : 0), 8, values[i] >> 4U);
        bits.set(pair + (second ? 12 : 8), 4, values[i] & 15U);
        break;
      default: break;
    }
  }
  return bits.bytes;
}

TEST(PixelRows, ReadEveryPackedPixel) {
  std::mt19937 random(1);
  for (const PixelFormat format :
       {PixelFormat::Mono10p, PixelFormat::Mono12p, PixelFormat::Mono10Packed, PixelFormat::Mono12Packed}) {
    for (const int width : {1, 2, 3, 5, 8, 31}) {
      constexpr int kHeight = 7;
      std::vector<std::uint32_t> values;
      for (int i = 0; i < width * kHeight; ++i) values.push_back(static_cast<std::uint32_t>(random()) & top_of(format));
      const std::vector<std::uint8_t> bytes = packed(format, values);
      const std::size_t bits = format == PixelFormat::Mono10p ? 10 : 12;
      const Image image{std::as_bytes(std::span(bytes)), (static_cast<std::size_t>(width) * bits + 7) / 8, width,
                        kHeight, format};
      ASSERT_TRUE(is_whole(image));
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < width; ++x) {
          std::uint16_t grey = 0;
          read_pixels(image, y, x, std::span(&grey, 1));
          ASSERT_EQ(grey, values[static_cast<std::size_t>(y * width + x)]) << width << ": " << x << " " << y;
        }
      }
    }
  }
}

TEST(PixelRows, ReadTheGreenOfABayerImage) {
  // Green is 100 + x + y; red and blue have other values. The mean of the green neighbours is 100 + x + y, too.
  constexpr int kSide = 8;
  for (const PixelFormat format : {PixelFormat::BayerGr8, PixelFormat::BayerRg8}) {
    std::vector<std::uint8_t> bytes;
    const int parity = format == PixelFormat::BayerGr8 ? 0 : 1;
    for (int i = 0; i < kSide * kSide; ++i) {
      const int x = i % kSide, y = i / kSide;
      bytes.push_back(static_cast<std::uint8_t>((x + y) % 2 == parity ? 100 + x + y : 7));
    }
    const Image image{std::as_bytes(std::span(bytes)), kSide, kSide, kSide, format};
    for (int y = 1; y + 1 < kSide; ++y) {
      std::vector<std::uint16_t> row(kSide - 2);
      read_pixels(image, y, 1, row);
      for (int i = 0; i < kSide - 2; ++i) EXPECT_EQ(row[static_cast<std::size_t>(i)], 101 + i + y);
    }
  }
}

TEST(RowMask, MasksThePixelsInsideAPolygon) {
  const std::vector<MaskPolygon> square{{{{10.0, 5.0}}, {{20.0, 5.0}}, {{20.0, 9.5}}, {{10.0, 9.5}}}};
  const RowMask mask(square, 40, 20);
  const std::uint64_t all = (1ULL << 40U) - 1, square_bits = ((1ULL << 11U) - 1) << 10U;
  const WordPlaces places(40);
  std::vector<BrightWord> words{
      {all, places.of(4, 0)}, {all, places.of(7, 0)}, {square_bits, places.of(9, 0)}, {all, places.of(10, 0)}};

  mask.clear_masked(words);

  EXPECT_EQ(words[0].bits, all);
  EXPECT_EQ(words[1].bits, all & ~square_bits);
  EXPECT_EQ(words[2].bits, 0U);
  EXPECT_EQ(words[3].bits, all);
  EXPECT_EQ(mask.count(), 11U * 5U);
  EXPECT_TRUE(mask.touches({7, 0, 10}));
  EXPECT_TRUE(mask.touches({10, 21, 30}));
  EXPECT_FALSE(mask.touches({7, 0, 9}));
  EXPECT_FALSE(mask.touches({15, 0, 40}));
}

TEST(RowMask, ExcludesBoxesFarFromItsPixels) {
  const std::vector<MaskPolygon> square{{{{70.0, 50.0}}, {{90.0, 50.0}}, {{90.0, 60.0}}, {{70.0, 60.0}}}};
  const RowMask mask(square, 200, 130);
  for (int y = 0; y < 130; ++y) {
    for (int x = 0; x < 200; ++x) {
      // A box of 5 by 4 pixels at (x, y).
      const bool touches = x <= 91 && x + 5 >= 70 && y <= 61 && y + 4 >= 50;
      EXPECT_TRUE(!touches || mask.may_touch(x, x + 5, y, y + 4)) << x << " " << y;
    }
  }
  EXPECT_FALSE(mask.may_touch(70, 75, 10, 14));
  EXPECT_FALSE(mask.may_touch(20, 25, 50, 54));
  EXPECT_FALSE(mask.may_touch(100, 105, 50, 54));
  EXPECT_FALSE(mask.may_touch(70, 75, 100, 130));
}

TEST(DetectBlobs, FindsNothingInsideAMaskAndIncreasesSigmaAtItsEdge) {
  std::vector<std::uint8_t> pixels(100 * 60, 10);
  const auto disc = [&](int cx, int cy) {
    for (int i = 0; i < 49; ++i) pixels[static_cast<std::size_t>((cy + i / 7) * 100 + cx + i % 7)] = 200;
  };
  disc(10, 10);
  disc(30, 10);
  disc(60, 30);
  const std::vector<MaskPolygon> masks{{{{0.0, 0.0}}, {{33.0, 0.0}}, {{33.0, 40.0}}, {{0.0, 40.0}}}};
  auto detector = std::move(make_blob_detector({}, PixelFormat::Mono8, 100, 60, masks)).value();

  const Detection found = detector->detect({std::as_bytes(std::span(pixels)), 100, 100, 60, PixelFormat::Mono8});

  ASSERT_EQ(found.blobs.size(), 2U);
  EXPECT_TRUE(found.blobs[0].touches_border);
  EXPECT_GT(found.blobs[0].sigma_px, 0.3);
  EXPECT_FALSE(found.blobs[1].touches_border);
}

}  // namespace pixel_formats_test
}  // namespace mocap::detect
