#include "detect/kernels/scalar_kernels.h"

#include <algorithm>

namespace mocap::detect {
namespace {

template <int kBytes>
std::uint32_t value(const std::byte* at, std::uint32_t kept) {
  const auto low = std::to_integer<std::uint32_t>(at[0]);
  if constexpr (kBytes == 1) return low;
  return (low | std::to_integer<std::uint32_t>(at[1]) << 8U) & kept;
}

template <int kBytes>
void scan(const ScanRows& rows, BrightWords& found) {
  for (int i = 0; i < rows.rows; ++i) {
    const std::byte* row = rows.bytes + static_cast<std::size_t>(i) * rows.stride_bytes;
    const int y = rows.first_y + i;
    BrightWord*& end = found.end(found.part_of(y));
    const BrightWord* begin = end;
    for (int x = 0; x < rows.width_px; x += 64) {
      const int n = std::min(64, rows.width_px - x);
      std::uint64_t bits = 0;
      for (int k = 0; k < n; ++k) {
        const bool bright = value<kBytes>(row + (x + k) * kBytes, rows.kept) >= rows.threshold;
        bits |= static_cast<std::uint64_t>(bright) << k;
      }
      if (bits != 0) *end++ = {bits, found.places().of(y, x / 64)};
    }
    found.count_row(begin, end);
  }
}

BoxStatistics survey(const Box& box, std::uint32_t threshold) {
  BoxStatistics seen;
  for (int i = 0; i < box.width_px * box.height_px; ++i) {
    const std::uint32_t grey = box.pixels[i];
    seen.peak = std::max(seen.peak, grey);
    seen.bright += grey >= threshold;
  }
  return seen;
}

BoxStatistics widen(const ByteWindow& window, const Box& box, std::uint16_t* pixels, std::uint32_t threshold) {
  for (int y = 0; y < box.height_px; ++y) {
    const std::byte* row = window.bytes + static_cast<std::size_t>(y) * window.stride_bytes;
    for (int x = 0; x < box.width_px; ++x) {
      *pixels++ = x < window.width_px ? std::to_integer<std::uint16_t>(row[x]) : std::uint16_t{0};
    }
  }
  return survey(box, threshold);
}

BoxSums weigh(const Box& box, const IntensityRamp& weighing) {
  BoxSums sums;
  const Scale scale(weighing.span);
  for (int i = 0; i < box.width_px * box.height_px; ++i) {
    const std::int64_t over = std::clamp<std::int64_t>(std::int64_t{box.pixels[i]} - weighing.low, 0, weighing.span);
    const std::int64_t u = (over << scale.shift) * scale.factor >> 16;
    const std::int64_t u2 = u * u >> 11;
    const std::int64_t powers[kPowers] = {u, u2, u * u2 >> 11};
    const std::int64_t slope = (u - u2 + 8) >> 4;
    const int x = i % box.width_px - box.width_px / 2;
    const int y = i / box.width_px - box.height_px / 2;
    for (int k = 0; k < kPowers; ++k) {
      sums.weight[k] += powers[k];
      sums.x[k] += powers[k] * x;
      sums.y[k] += powers[k] * y;
    }
    sums.slope2 += slope * slope;
  }
  return sums;
}

}  // namespace

const DetectKernels& scalar_kernels() {
  static constexpr DetectKernels kKernels{"scalar", scan<1>, scan<2>, widen, survey, weigh};
  return kKernels;
}

}  // namespace mocap::detect
