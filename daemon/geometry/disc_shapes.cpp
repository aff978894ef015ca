#include "geometry/disc_shapes.h"

#include <algorithm>
#include <cmath>

namespace mocap::geometry {
namespace {

// Slices of the numerical integration, across the long axis; the relative error of the area is 1e-5.
constexpr int kSlices = 2000;

// Half of the chord of the unit circle at distance x from its centre.
double half_chord(double x) { return std::sqrt(std::max(0.0, 1.0 - x * x)); }

}  // namespace

TwoDiscs::TwoDiscs() {
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double half = 0.5 * kMax * static_cast<double>(i) / (kSteps - 1);
    const double end = half + 1.0;
    double area = 0.0;
    double along = 0.0;
    double across = 0.0;
    for (int slice = 0; slice < kSlices; ++slice) {
      const double x = end * (slice + 0.5) / kSlices;  // one half of the union; the other half is its mirror image
      const double h = std::max(half_chord(x - half), half_chord(x + half));
      area += h;
      along += h * x * x;
      across += h * h * h / 3.0;
    }
    area_ratio_[i] = area * 4.0 * end / kSlices / M_PI;
    roundness_[i] = std::sqrt(across / along);
  }
}

double TwoDiscs::distance_from_area(double area_ratio) const {
  constexpr double kStep = kMax / (kSteps - 1);
  const auto above = std::upper_bound(area_ratio_.begin(), area_ratio_.end(), area_ratio);
  if (above == area_ratio_.begin()) return 0.0;
  if (above == area_ratio_.end() || area_ratio >= 2.0 - 1e-3) return 2.0;
  const double below = *(above - 1);
  return kStep * (static_cast<double>(above - area_ratio_.begin() - 1) + (area_ratio - below) / (*above - below));
}

double TwoDiscs::distance_from_roundness(double roundness) const {
  constexpr double kStep = kMax / (kSteps - 1);
  const auto below = std::find_if(roundness_.begin(), roundness_.end(), [&](double r) { return r < roundness; });
  if (below == roundness_.begin()) return 0.0;
  if (below == roundness_.end()) return kMax;
  const double above = *(below - 1);
  return kStep * (static_cast<double>(below - roundness_.begin() - 1) + (above - roundness) / (above - *below));
}

CutDisc::CutDisc() {
  shapes_.front() = {1.0, 0.0};
  shapes_.back() = {0.0, 1.0};
  double area = 0.0;
  double first = 0.0;  // moments of the visible part, x from the rim at -1 to the straight edge
  double along = 0.0;
  double across = 0.0;
  std::size_t next = 1;
  for (int slice = 0; slice < 2 * kSlices && next + 1 < kSteps; ++slice) {
    const double x = -1.0 + (slice + 0.5) / kSlices;
    const double h = half_chord(x);
    area += h;
    first += h * x;
    across += h * x * x;
    along += h * h * h / 3.0;
    if (area * 2.0 / kSlices / M_PI < static_cast<double>(next) / (kSteps - 1)) continue;
    const double middle = first / area;
    const double thin = across / area - middle * middle;
    const double ratio = thin / (along / area);
    shapes_[next++] = {-middle, std::sqrt(std::min(ratio, 1.0 / ratio))};
  }
}

CutDisc::Shape CutDisc::shape(double share) const {
  const double at = std::clamp(share, 0.0, 1.0) * (kSteps - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(at), kSteps - 2);
  const double part = at - static_cast<double>(below);
  const Shape& a = shapes_[below];
  const Shape& b = shapes_[below + 1];
  return {a.offset + part * (b.offset - a.offset), a.roundness + part * (b.roundness - a.roundness)};
}

}  // namespace mocap::geometry
