#include "detect/pixel_rows.h"

#include <cstring>

namespace mocap::detect {
namespace {

enum class Layout { None, Byte, Word, WordsLowByte, PackedBits, PackedPairs, Bayer };

struct PixelLayout {
  Layout layout = Layout::None;
  std::uint32_t bits = 0;          // significant bits of a pixel
  std::uint32_t green_parity = 0;  // Bayer: a pixel is green if (x + y) % 2 has this value
};

constexpr PixelLayout layout_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::Mono8:
    case PixelFormat::Nv12: return {Layout::Byte, 8};
    case PixelFormat::Yuyv: return {Layout::WordsLowByte, 8};
    case PixelFormat::Mono10: return {Layout::Word, 10};
    case PixelFormat::Mono12: return {Layout::Word, 12};
    case PixelFormat::Mono10p: return {Layout::PackedBits, 10};
    case PixelFormat::Mono12p: return {Layout::PackedBits, 12};
    case PixelFormat::Mono10Packed: return {Layout::PackedPairs, 10};
    case PixelFormat::Mono12Packed: return {Layout::PackedPairs, 12};
    case PixelFormat::BayerGr8:
    case PixelFormat::BayerGb8: return {Layout::Bayer, 8, 0};
    case PixelFormat::BayerRg8:
    case PixelFormat::BayerBg8: return {Layout::Bayer, 8, 1};
    case PixelFormat::Mjpeg: break;
  }
  return {};
}

/// The bits that a pixel of a packed format occupies, including unused bits of a pair.
constexpr std::size_t packed_bits(const PixelLayout& pixel_layout) {
  return pixel_layout.layout == Layout::PackedPairs ? 12 : pixel_layout.bits;
}

std::size_t bytes_of_pixels(const PixelLayout& pixel_layout, std::size_t pixels) {
  switch (pixel_layout.layout) {
    case Layout::None: return 0;
    case Layout::Byte:
    case Layout::Bayer: return pixels;
    case Layout::Word:
    case Layout::WordsLowByte: return 2 * pixels;
    case Layout::PackedBits:
    case Layout::PackedPairs: break;
  }
  return (pixels * packed_bits(pixel_layout) + 7) / 8;
}

/// Whether rows are packed without padding, so that a row may begin within a byte.
bool runs_on(const PixelLayout& pixel_layout, const Image& image) {
  const bool packed = pixel_layout.layout == Layout::PackedBits || pixel_layout.layout == Layout::PackedPairs;
  return packed && image.stride_bytes == bytes_of_pixels(pixel_layout, static_cast<std::size_t>(image.width_px));
}

/// The position of the first pixel of a row: `pixel` pixels after the byte.
struct RowPlace {
  const std::byte* bytes;
  std::size_t pixel;
};

RowPlace row_place(const PixelLayout& pixel_layout, const Image& image, int y) {
  if (runs_on(pixel_layout, image)) {
    return {image.bytes.data(), static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px)};
  }
  return {image.bytes.data() + static_cast<std::size_t>(y) * image.stride_bytes, 0};
}

std::uint32_t word_at(const std::byte* at) {
  return std::to_integer<std::uint32_t>(at[0]) | std::to_integer<std::uint32_t>(at[1]) << 8U;
}

// A pixel begins at an even bit (10 bits) or at a multiple of four bits (12 bits), so it lies in at most two bytes.
void read_bits(const std::byte* bytes, std::size_t first, std::uint32_t bits, std::span<std::uint16_t> grey) {
  const std::uint32_t value_mask = (1U << bits) - 1U;
  std::size_t bit = first * bits;
  for (std::uint16_t& value : grey) {
    value = static_cast<std::uint16_t>(word_at(bytes + bit / 8) >> bit % 8 & value_mask);
    bit += bits;
  }
}

// Two pixels occupy three bytes: the high bits of the first pixel, the low bits of both in one nibble each, the high
// bits of the second pixel.
void read_pairs(const std::byte* bytes, std::size_t first, std::uint32_t bits, std::span<std::uint16_t> grey) {
  const std::uint32_t low_bits = bits - 8;
  const std::uint32_t value_mask = (1U << low_bits) - 1U;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const std::size_t pixel = first + i;
    const std::byte* pair = bytes + pixel / 2 * 3;
    const bool second = pixel % 2 != 0;
    const auto high = std::to_integer<std::uint32_t>(pair[second ? 2 : 0]);
    const auto low = std::to_integer<std::uint32_t>(pair[1]) >> (second ? 4U : 0U) & value_mask;
    grey[i] = static_cast<std::uint16_t>(high << low_bits | low);
  }
}

void read_green(const Image& image, int y, int x, std::uint32_t parity, std::span<std::uint16_t> grey) {
  const auto at = [&](int column, int row) {
    return std::to_integer<std::uint32_t>(
        image.bytes[static_cast<std::size_t>(row) * image.stride_bytes + static_cast<std::size_t>(column)]);
  };
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const int column = x + static_cast<int>(i);
    if ((static_cast<std::uint32_t>(column + y) & 1U) == parity) {
      grey[i] = static_cast<std::uint16_t>(at(column, y));
      continue;
    }
    // At the border, the neighbour inside the image replaces the neighbour outside.
    const bool wide = image.width_px > 1, high = image.height_px > 1;
    const int left = column > 0 ? column - 1 : column + 1,
              right = column + 1 < image.width_px ? column + 1 : column - 1;
    const int above = y > 0 ? y - 1 : y + 1, below = y + 1 < image.height_px ? y + 1 : y - 1;
    std::uint32_t sum = wide ? at(left, y) + at(right, y) : 0U;
    sum += high ? at(column, above) + at(column, below) : 0U;
    const std::uint32_t neighbours = (wide ? 2U : 0U) + (high ? 2U : 0U);
    grey[i] = static_cast<std::uint16_t>(neighbours == 0 ? at(column, y) : (sum + neighbours / 2) / neighbours);
  }
}

}  // namespace

std::uint32_t top_of(PixelFormat format) {
  const std::uint32_t bits = layout_of(format).bits;
  return bits == 0 ? 0U : (1U << bits) - 1U;
}

std::size_t bytes_in_place(PixelFormat format) {
  switch (layout_of(format).layout) {
    case Layout::Byte: return 1;
    case Layout::Word:
    case Layout::WordsLowByte: return 2;
    default: return 0;
  }
}

std::uint16_t kept_bits(PixelFormat format) {
  return layout_of(format).layout == Layout::WordsLowByte ? 0x00FF : static_cast<std::uint16_t>(top_of(format));
}

bool is_whole(const Image& image) {
  const PixelLayout pixel_layout = layout_of(image.format);
  if (pixel_layout.layout == Layout::None || image.width_px < 1 || image.height_px < 1) return false;
  const auto width = static_cast<std::size_t>(image.width_px), height = static_cast<std::size_t>(image.height_px);
  const std::size_t row_bytes = bytes_of_pixels(pixel_layout, width);
  if (image.stride_bytes < row_bytes) return false;
  if (runs_on(pixel_layout, image)) return image.bytes.size() >= bytes_of_pixels(pixel_layout, width * height);
  return image.bytes.size() >= row_bytes && (image.bytes.size() - row_bytes) / image.stride_bytes >= height - 1;
}

void read_pixels(const Image& image, int y, int x, std::span<std::uint16_t> grey) {
  const PixelLayout pixel_layout = layout_of(image.format);
  const auto [row, skip] = row_place(pixel_layout, image, y);
  const auto first = static_cast<std::size_t>(x);
  switch (pixel_layout.layout) {
    case Layout::None: break;
    case Layout::Byte:
      for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = std::to_integer<std::uint16_t>(row[first + i]);
      break;
    case Layout::Word: {
      const auto value_mask = top_of(image.format);
      for (std::size_t i = 0; i < grey.size(); ++i) {
        grey[i] = static_cast<std::uint16_t>(word_at(row + 2 * (first + i)) & value_mask);
      }
      break;
    }
    case Layout::WordsLowByte:
      for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = std::to_integer<std::uint16_t>(row[2 * (first + i)]);
      break;
    case Layout::PackedBits: read_bits(row, skip + first, pixel_layout.bits, grey); break;
    case Layout::PackedPairs: read_pairs(row, skip + first, pixel_layout.bits, grey); break;
    case Layout::Bayer: read_green(image, y, x, pixel_layout.green_parity, grey); break;
  }
}

}  // namespace mocap::detect
