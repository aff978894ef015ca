#include "detect/decimate.h"

#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace decimate_test {

// An image in which each byte has another value than its neighbours.
struct Pattern {
  Pattern(PixelFormat format, int width_px, int height_px, std::size_t stride_bytes)
      : bytes(stride_bytes * static_cast<std::size_t>(height_px)) {
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i * 7 + i / 251);
    image = {bytes, stride_bytes, width_px, height_px, format};
  }
  std::vector<std::byte> bytes;
  Image image;
};

TEST(Decimate, TakesEveryNthPixelOfEveryNthRow) {
  for (const int step : {1, 2, 3, 7}) {
    for (const int width : {1, 1023, 1024, 1025, 2050}) {
      const Pattern pattern(PixelFormat::Mono8, width, 9, 2100);
      const int columns = (width + step - 1) / step, rows = (9 + step - 1) / step;
      std::vector<std::uint8_t> grey(static_cast<std::size_t>(columns * rows) + 1, 77);

      decimate(pattern.image, step, grey);

      for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
          const std::size_t from = static_cast<std::size_t>(y * step) * 2100 + static_cast<std::size_t>(x * step);
          ASSERT_EQ(grey[static_cast<std::size_t>(y * columns + x)],
                    std::to_integer<std::uint8_t>(pattern.bytes[from]));
        }
      }
      EXPECT_EQ(grey.back(), 77) << "wrote beyond the preview";
    }
  }
}

TEST(Decimate, ScalesEveryFormatToEightBits) {
  for (const PixelFormat format :
       {PixelFormat::Mono10, PixelFormat::Mono12, PixelFormat::Mono10p, PixelFormat::Mono12p, PixelFormat::Mono10Packed,
        PixelFormat::Mono12Packed, PixelFormat::BayerRg8, PixelFormat::Yuyv}) {
    const Pattern pattern(format, 12, 4, 64);
    std::vector<std::uint8_t> grey(6 * 2);
    std::vector<std::uint16_t> row(12);
    const std::uint32_t top = top_of(format);

    decimate(pattern.image, 2, grey);

    for (int y = 0; y < 2; ++y) {
      read_pixels(pattern.image, 2 * y, 0, row);
      for (std::size_t x = 0; x < 6; ++x) {
        EXPECT_EQ(grey[static_cast<std::size_t>(y) * 6 + x], row[2 * x] * 256U / (top + 1)) << static_cast<int>(format);
      }
    }
  }
}

}  // namespace decimate_test
}  // namespace mocap::detect
