#include "detect/components/shape.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mocap::detect {
namespace shape_test {

TEST(Shape, HasTheAxisOfTheStandardArctangent) {
  for (int degree = -180; degree <= 180; ++degree) {
    const double twice_rad = degree * M_PI / 180.0;
    Shape shape;
    shape.xx = 2.0 + 0.5 * std::cos(twice_rad);
    shape.yy = 2.0 - 0.5 * std::cos(twice_rad);
    shape.xy = 0.5 * std::sin(twice_rad);

    const double axis_rad = shape.axis_rad();

    // Half of 2e-8, the error of the series.
    EXPECT_NEAR(axis_rad, 0.5 * std::atan2(2.0 * shape.xy, shape.xx - shape.yy), 1e-8) << degree;
  }
}

TEST(Shape, HasAnAxisOfZeroIfRound) { EXPECT_EQ(Shape{}.axis_rad(), 0.0); }

}  // namespace shape_test
}  // namespace mocap::detect
