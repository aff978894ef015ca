#include "detect/components/shape.h"

#include <algorithm>
#include <cmath>

namespace mocap::detect {
namespace {

// The arctangent of 0 to 1, with an error of at most 2e-8. Takes a quarter of the time of std::atan and gives the same
// result on every processor. Source: Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 4.4.49.
double arctangent(double x) {
  const double s = x * x, s2 = s * s, s4 = s2 * s2;
  const double low = (1.0 - 0.3333314528 * s) + (0.1999355085 - 0.1420889944 * s) * s2;
  const double high = (0.1065626393 - 0.0752896400 * s) + (0.0429096138 - 0.0161657367 * s) * s2;
  return x * (low + (high + 0.0028662257 * s4) * s4);
}

}  // namespace

Shape shape_of(const RunSums& sums) {
  const double each = 1.0 / static_cast<double>(sums.n);
  const auto of = [each](std::int64_t value) { return static_cast<double>(value) * each; };
  Shape shape;
  shape.begin_x = sums.begin_x;
  shape.end_x = sums.end_x;
  shape.begin_y = sums.begin_y;
  shape.end_y = sums.end_y;
  shape.area_px2 = static_cast<double>(sums.n);
  shape.x = 0.5 * of(sums.x);
  shape.y = of(sums.y);
  // The pixel centres of a run have the variance (length^2 - 1) / 12; the square shape of a pixel adds 1 / 12.
  shape.xx = 0.25 * of(sums.xx) + of(sums.cubes) / 12.0 - shape.x * shape.x;
  shape.yy = of(sums.yy) - shape.y * shape.y + 1.0 / 12.0;
  shape.xy = 0.5 * of(sums.xy) - shape.x * shape.y;
  return shape;
}

double Shape::roundness() const {
  const double mean = 0.5 * (xx + yy);
  const double half_range = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  return std::sqrt(std::clamp((mean - half_range) / (mean + half_range), 0.0, 1.0));
}

double Shape::axis_rad() const {
  const double across = 2.0 * xy, along = xx - yy;
  const double low = std::min(std::abs(across), std::abs(along)), high = std::max(std::abs(across), std::abs(along));
  double angle_rad = high > 0.0 ? arctangent(low / high) : 0.0;
  // Without a branch, because the processor cannot predict the direction of a round blob.
  const auto is_steep = static_cast<double>(std::abs(across) > std::abs(along));
  const auto is_back = static_cast<double>(along < 0.0);
  angle_rad += is_steep * (0.5 * M_PI - 2.0 * angle_rad);
  angle_rad += is_back * (M_PI - 2.0 * angle_rad);
  return std::copysign(0.5 * angle_rad, across);
}

}  // namespace mocap::detect
