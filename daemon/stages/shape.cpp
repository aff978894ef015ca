#include "stages/shape.h"

#include <cmath>

namespace mocap::stages {

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
  // The pixels of a run spread by (length^2 - 1) / 12; a pixel that is a square makes up for the one.
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

double Shape::axis_rad() const { return 0.5 * std::atan2(2.0 * xy, xx - yy); }

}  // namespace mocap::stages
