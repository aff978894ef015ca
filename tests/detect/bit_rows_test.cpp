#include "detect/bit_rows.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace mocap::detect {
namespace bit_rows_test {

constexpr int kWidth_px = 256;
using Row = std::array<std::uint64_t, kWidth_px / 64>;

bool is_bright(const Row& row, int x) { return (row[static_cast<std::size_t>(x / 64)] >> (x % 64) & 1U) != 0; }

TEST(BitRows, FindTheFirstBrightPixelOfEachRange) {
  std::mt19937_64 random(4);
  for (const int sparse : {0, 1, 2, 4}) {
    Row row;
    for (std::uint64_t& word : row) {
      word = random();
      for (int i = 0; i < sparse; ++i) word &= random() & random();
    }
    for (int begin = 0; begin < kWidth_px; begin += 3) {
      for (int end = begin; end <= kWidth_px; ++end) {
        int first = begin;
        while (first < end && !is_bright(row, first)) ++first;

        ASSERT_EQ(first_bright(row.data(), begin, end), first) << begin << " to " << end;
        ASSERT_EQ(any_bright(row.data(), begin, end), first < end) << begin << " to " << end;
      }
    }
  }
}

TEST(BitRows, FindNothingInADarkRowOrAnEmptyRange) {
  const Row dark{};
  Row white;
  white.fill(~0ULL);

  EXPECT_EQ(first_bright(dark.data(), 5, 200), 200);
  EXPECT_FALSE(any_bright(dark.data(), 0, kWidth_px));
  EXPECT_FALSE(any_bright(white.data(), 64, 64));
  EXPECT_TRUE(any_bright(white.data(), 63, 64));
}

TEST(BitRows, MaskThePixelsOfARangeThatLieInOneWord) {
  for (int x = 0; x < 128; ++x) {
    for (int end = x + 1; end < 200; ++end) {
      const std::uint64_t mask = bits_between(x, end);
      for (int bit = 0; bit < 64; ++bit) {
        const int pixel = x / 64 * 64 + bit;
        ASSERT_EQ(mask >> bit & 1U, pixel >= x && pixel < end ? 1U : 0U) << x << " to " << end;
      }
    }
  }
}

}  // namespace bit_rows_test
}  // namespace mocap::detect
