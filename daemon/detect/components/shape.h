#pragma once

#include <algorithm>
#include <cstdint>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Sums over the runs of a component that determine its shape. Integers, so that the order of summation does not
/// matter; without overflow for images of up to 32767 x 32767 px.
struct RunSums {
  std::int64_t n = 0;              ///< pixels
  std::int64_t x = 0, y = 0;       ///< sums of twice x, and of y, over the pixels
  std::int64_t xx = 0, cubes = 0;  ///< squares of twice the runs' middles, by pixel; cubes of their lengths
  std::int64_t yy = 0, xy = 0;
  int begin_x = 0, end_x = 0, begin_y = 0, end_y = 0;

  /// Runs are in the order of rows.
  void add(const Run& run) {
    const std::int64_t length = run.end - run.begin, middle = run.begin + run.end - 1, at_y = run.y;
    const std::int64_t sum = length * middle;
    n += length;
    x += sum;
    y += at_y * length;
    xx += sum * middle;
    cubes += length * length * length;
    yy += at_y * at_y * length;
    xy += at_y * sum;
    begin_x = std::min<int>(begin_x, run.begin);
    end_x = std::max<int>(end_x, run.end);
    end_y = run.y + 1;
  }

  /// Translates the summed runs.
  void move(std::int64_t by_x, std::int64_t by_y) {
    const std::int64_t twice_x = 2 * by_x;
    xx += twice_x * (2 * x + twice_x * n);
    xy += by_y * x + twice_x * (y + by_y * n);
    yy += by_y * (2 * y + by_y * n);
    x += twice_x * n;
    y += by_y * n;
    begin_x += static_cast<int>(by_x);
    end_x += static_cast<int>(by_x);
    begin_y += static_cast<int>(by_y);
    end_y += static_cast<int>(by_y);
  }

  void add(const RunSums& other) {
    n += other.n;
    x += other.x;
    y += other.y;
    xx += other.xx;
    cubes += other.cubes;
    yy += other.yy;
    xy += other.xy;
    begin_x = std::min(begin_x, other.begin_x);
    end_x = std::max(end_x, other.end_x);
    begin_y = std::min(begin_y, other.begin_y);
    end_y = std::max(end_y, other.end_y);
  }
};

/// Shape of a component, from its runs without their intensities.
struct Shape {
  int begin_x = 0, end_x = 0, begin_y = 0, end_y = 0;  ///< bounding box
  double area_px2 = 0.0;
  double x = 0.0, y = 0.0;              ///< centre of gravity
  double xx = 0.0, yy = 0.0, xy = 0.0;  ///< second moments about the centre; a pixel is a unit square

  double roundness() const;  ///< the ratio of the axes of the ellipse with the same moments
  double axis_rad() const;   ///< direction of the major axis, from x towards y
};

Shape shape_of(const RunSums& sums);

}  // namespace mocap::detect
