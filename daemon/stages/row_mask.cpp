#include "stages/row_mask.h"

#include <algorithm>
#include <cmath>

namespace mocap::stages {
namespace {

/// Where the polygon's sides cross the line through a row's pixel centres, from left to right.
std::vector<double> crossings(const MaskPolygon& polygon, double y) {
  std::vector<double> found;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto& a = polygon[i].v;
    const auto& b = polygon[(i + 1) % polygon.size()].v;
    // A corner on the line belongs to the side above it only.
    if ((a.y() <= y) == (b.y() <= y)) continue;
    found.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

RowMask::RowMask(std::span<const MaskPolygon> polygons, int width_px, int height_px) {
  first_.push_back(0);
  std::vector<Stretch> stretches;
  for (int y = 0; y < height_px; ++y) {
    stretches.clear();
    for (const MaskPolygon& polygon : polygons) {
      const std::vector<double> sides = crossings(polygon, y);
      for (std::size_t i = 0; i + 1 < sides.size(); i += 2) {
        const double begin = std::clamp(std::ceil(sides[i]), 0.0, static_cast<double>(width_px));
        const double end = std::clamp(std::floor(sides[i + 1]) + 1.0, 0.0, static_cast<double>(width_px));
        if (begin < end) stretches.push_back({static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)});
      }
    }
    std::sort(stretches.begin(), stretches.end(), [](Stretch a, Stretch b) { return a.begin < b.begin; });
    for (const Stretch& each : stretches) {
      if (stretches_.size() > first_.back() && each.begin <= stretches_.back().end) {
        stretches_.back().end = std::max(stretches_.back().end, each.end);
      } else {
        stretches_.push_back(each);
      }
    }
    first_.push_back(static_cast<std::uint32_t>(stretches_.size()));
  }
}

std::span<const RowMask::Stretch> RowMask::row(int y) const {
  if (y < 0 || static_cast<std::size_t>(y) + 1 >= first_.size()) return {};
  const auto at = static_cast<std::size_t>(y);
  return std::span(stretches_).subspan(first_[at], first_[at + 1] - first_[at]);
}

std::size_t RowMask::cut(std::span<const Run> runs, std::span<Run> left) const {
  std::size_t count = 0;
  for (const Run& run : runs) {
    Run rest = run;
    for (const Stretch& stretch : row(run.y)) {
      if (stretch.end <= rest.begin) continue;
      if (stretch.begin >= rest.end) break;
      if (stretch.begin > rest.begin && count < left.size()) left[count++] = {rest.y, rest.begin, stretch.begin};
      rest.begin = std::min(stretch.end, rest.end);
      if (rest.begin == rest.end) break;
    }
    if (rest.begin < rest.end && count < left.size()) left[count++] = rest;
  }
  return count;
}

bool RowMask::meets(int y, int begin, int end) const {
  const auto stretches = row(y);
  return std::any_of(stretches.begin(), stretches.end(),
                     [&](const Stretch& each) { return each.begin < end && begin < each.end; });
}

bool RowMask::touches(const Run& run) const {
  for (int y = run.y - 1; y <= run.y + 1; ++y) {
    if (meets(y, run.begin - 1, run.end + 1)) return true;
  }
  return false;
}

bool RowMask::masks(int x, int y) const { return meets(y, x, x + 1); }

std::size_t RowMask::count() const {
  std::size_t pixels = 0;
  for (const Stretch& each : stretches_) pixels += static_cast<std::size_t>(each.end - each.begin);
  return pixels;
}

}  // namespace mocap::stages
