#include "cameras/image_layout.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace mocap::cameras {
namespace image_layout_test {

// Bits from one pixel to the next. In YUYV every second byte is luminance.
const std::vector<std::pair<PixelFormat, std::size_t>> kBits{
    {PixelFormat::Mono8, 8},         {PixelFormat::Mono10, 16},  {PixelFormat::Mono12, 16},
    {PixelFormat::Mono10p, 10},      {PixelFormat::Mono12p, 12}, {PixelFormat::Mono10Packed, 12},
    {PixelFormat::Mono12Packed, 12}, {PixelFormat::BayerGr8, 8}, {PixelFormat::BayerRg8, 8},
    {PixelFormat::BayerGb8, 8},      {PixelFormat::BayerBg8, 8}, {PixelFormat::Yuyv, 16},
    {PixelFormat::Nv12, 8}};

bool is_bit_packed(PixelFormat format) {
  return format == PixelFormat::Mono10p || format == PixelFormat::Mono12p || format == PixelFormat::Mono10Packed ||
         format == PixelFormat::Mono12Packed;
}

// The bytes that are touched by writing `bits` bits one after the other.
std::size_t bytes_of(std::size_t bits) {
  std::size_t bytes = 0;
  for (std::size_t bit = 0; bit < bits; ++bit) bytes = bit / 8 + 1;
  return bytes;
}

TEST(ImageLayout, ARowHasTheBytesOfItsBits) {
  for (const auto& [format, bits] : kBits) {
    for (int width = 1; width <= 9; ++width) {
      EXPECT_EQ(packed_stride_bytes(format, width), bytes_of(bits * static_cast<std::size_t>(width)))
          << static_cast<int>(format) << " width " << width;
    }
  }
}

TEST(ImageLayout, PackedPixelsContinueFromRowToRow) {
  for (const auto& [format, bits] : kBits) {
    if (!is_bit_packed(format)) continue;
    for (int width = 1; width <= 7; ++width) {
      const std::size_t stride = packed_stride_bytes(format, width);
      EXPECT_EQ(luminance_bytes(format, stride, width, 5), bytes_of(bits * static_cast<std::size_t>(5 * width)))
          << static_cast<int>(format) << " width " << width;
    }
  }
}

TEST(ImageLayout, TheLastRowMayLackItsPadding) {
  for (const auto& [format, bits] : kBits) {
    if (is_bit_packed(format)) continue;
    const std::size_t row = bits / 8 * 5;
    constexpr std::size_t kStride = 32;
    EXPECT_EQ(luminance_bytes(format, kStride, 5, 3), 2 * kStride + row) << static_cast<int>(format);
    EXPECT_EQ(luminance_bytes(format, row, 5, 3), 3 * row) << static_cast<int>(format);
  }
}

TEST(ImageLayout, AnEmptyImageNeedsNoBytes) {
  for (const auto& [format, bits] : kBits) {
    EXPECT_EQ(luminance_bytes(format, bits, 8, 0), 0U) << static_cast<int>(format);
  }
}

TEST(ImageLayout, MjpegHasNoRows) { EXPECT_EQ(packed_stride_bytes(PixelFormat::Mjpeg, 640), 0U); }

}  // namespace image_layout_test
}  // namespace mocap::cameras
