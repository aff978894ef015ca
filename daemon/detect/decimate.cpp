#include "detect/decimate.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/expects.h"
#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

constexpr int kAtOnce = 1024;  // pixels of a row; a buffer on the stack

}  // namespace

void decimate(const Image& image, int step, std::span<std::uint8_t> grey) {
  MOCAP_EXPECTS(step >= 1 && is_whole(image));
  const int shift = std::bit_width(top_of(image.format)) - 8;
  std::array<std::uint16_t, kAtOnce> row;
  std::size_t next = 0;
  for (int y = 0; y < image.height_px; y += step) {
    int taken = 0;  // the column of the next pixel of the preview
    for (int x = 0; x < image.width_px; x += kAtOnce) {
      const int count = std::min(kAtOnce, image.width_px - x);
      read_pixels(image, y, x, std::span(row).first(static_cast<std::size_t>(count)));
      for (; taken < x + count; taken += step) {
        grey[next++] = static_cast<std::uint8_t>(row[static_cast<std::size_t>(taken - x)] >> shift);
      }
    }
  }
}

}  // namespace mocap::detect
