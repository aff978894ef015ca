#include "detect/row_mask.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "detect/bit_rows.h"

namespace mocap::detect {
namespace {

constexpr int kBandRows = 16;

/// The x at which the sides of a polygon cross the line through the pixel centres of a row, in ascending order.
std::vector<double> crossings(const MaskPolygon& polygon, double y) {
  std::vector<double> found;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto& a = polygon[i].v;
    const auto& b = polygon[(i + 1) % polygon.size()].v;
    // A corner on the line belongs only to the side above the corner.
    if ((a.y() <= y) == (b.y() <= y)) continue;
    found.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

RowMask::RowMask(std::span<const MaskPolygon> polygons, int width_px, int height_px)
    : width_px_(width_px), height_px_(height_px), places_(width_px) {
  if (polygons.empty()) return;
  bits_.resize(first_word(height_px));
  words_.resize(bits_.size() / 64 + 1);
  bands_.resize(first_word(height_px / kBandRows + 1));
  for (int y = 0; y < height_px; ++y) {
    for (const MaskPolygon& polygon : polygons) {
      const std::vector<double> sides = crossings(polygon, y);
      for (std::size_t i = 0; i + 1 < sides.size(); i += 2) {
        const double begin = std::clamp(std::ceil(sides[i]), 0.0, static_cast<double>(width_px));
        const double end = std::clamp(std::floor(sides[i + 1]) + 1.0, 0.0, static_cast<double>(width_px));
        fill(y, static_cast<int>(begin), static_cast<int>(end));
      }
    }
  }
}

void RowMask::fill(int y, int begin, int end) {
  std::uint64_t* of_row = bits_.data() + first_word(y);
  std::uint64_t* of_band = bands_.data() + first_word(y / kBandRows);
  for (int x = begin; x < end; x = (x | 63) + 1) {
    of_row[x >> 6] |= bits_between(x, end);
    of_band[x >> 6] |= bits_between(x, end);
    const std::uint32_t place = places_.of(y, x >> 6);
    words_[place / 64] |= 1ULL << place % 64;
  }
}

void RowMask::clear_masked(std::span<BrightWord> words) const {
  for (BrightWord& each : words) {
    // Most words have no masked pixel.
    if ((words_[each.place / 64] >> each.place % 64 & 1U) != 0) each.bits &= ~bits_[each.place];
  }
}

bool RowMask::has_masked(int y, int begin, int end) const {
  if (empty() || y < 0 || y >= height_px_) return false;
  return any_bright(bits_.data() + first_word(y), std::max(0, begin), std::min(end, width_px_));
}

bool RowMask::may_touch(int begin_x, int end_x, int begin_y, int end_y) const {
  if (empty()) return false;
  const int begin = std::max(0, begin_x - 1), end = std::min(width_px_, end_x + 1);
  const int last = std::min(height_px_ - 1, end_y) / kBandRows;
  for (int band = std::max(0, begin_y - 1) / kBandRows; band <= last; ++band) {
    if (any_bright(bands_.data() + first_word(band), begin, end)) return true;
  }
  return false;
}

bool RowMask::touches(const Run& run) const {
  for (int y = run.y - 1; y <= run.y + 1; ++y) {
    if (has_masked(y, run.begin - 1, run.end + 1)) return true;
  }
  return false;
}

std::size_t RowMask::count() const {
  std::size_t pixels = 0;
  for (const std::uint64_t each : bits_) pixels += static_cast<std::size_t>(std::popcount(each));
  return pixels;
}

}  // namespace mocap::detect
