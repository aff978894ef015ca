#include "geometry/disc_shapes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mocap::geometry {
namespace disc_shapes_test {

struct Moments {
  double area = 0.0;
  double x = 0.0;  ///< centroid
  double roundness = 0.0;
};

/// Moments of a shape by counting the points of a fine grid inside it.
template <class Inside>
Moments count(Inside&& inside) {
  constexpr int kPoints = 1200;
  constexpr double kHalf = 2.4;
  const double step = 2.0 * kHalf / kPoints;
  double n = 0.0, sx = 0.0, sxx = 0.0, syy = 0.0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const double x = -kHalf + (i + 0.5) * step;
      const double y = -kHalf + (j + 0.5) * step;
      if (!inside(x, y)) continue;
      n += 1.0;
      sx += x;
      sxx += x * x;
      syy += y * y;
    }
  }
  const double mean = sx / n;
  const double ratio = (sxx / n - mean * mean) / (syy / n);
  return {n * step * step, mean, std::sqrt(std::min(ratio, 1.0 / ratio))};
}

TEST(TwoDiscs, GivesTheDistanceFromMomentsOfCountedPoints) {
  const TwoDiscs discs;
  for (const double distance : {0.0, 0.1, 0.45, 1.0, 1.6, 1.95, 2.4}) {
    const double half = 0.5 * distance;
    const Moments seen = count([&](double x, double y) {
      return (x - half) * (x - half) + y * y < 1.0 || (x + half) * (x + half) + y * y < 1.0;
    });

    // A step of the table is 0.05. The area changes little near two radii, and counted points are accurate to 1e-3.
    EXPECT_NEAR(discs.distance_from_area(seen.area / M_PI), std::min(distance, 2.0), 0.02) << distance;
    EXPECT_NEAR(discs.distance_from_roundness(seen.roundness), distance, 0.01) << distance;
  }
}

TEST(TwoDiscs, ClampsToItsRange) {
  const TwoDiscs discs;
  EXPECT_EQ(discs.distance_from_area(0.3), 0.0);
  EXPECT_EQ(discs.distance_from_area(7.0), 2.0);
  EXPECT_EQ(discs.distance_from_roundness(1.2), 0.0);
  EXPECT_EQ(discs.distance_from_roundness(0.0), TwoDiscs::kMax);
}

TEST(CutDisc, GivesTheCentreFromMomentsOfCountedPoints) {
  const CutDisc cut;
  for (const double edge : {-0.7, -0.4, 0.0, 0.3, 0.6, 0.9}) {
    const Moments seen = count([&](double x, double y) { return x * x + y * y < 1.0 && x < edge; });

    const CutDisc::Shape shape = cut.shape(seen.area / M_PI);

    EXPECT_NEAR(shape.offset, -seen.x, 0.01) << edge;
    EXPECT_NEAR(shape.roundness, seen.roundness, 0.02) << edge;
  }
}

TEST(CutDisc, IsAWholeDiscIfNothingIsHidden) {
  const CutDisc cut;
  EXPECT_EQ(cut.shape(1.3).offset, 0.0);
  EXPECT_EQ(cut.shape(1.0).roundness, 1.0);
  EXPECT_EQ(cut.shape(-1.0).offset, 1.0);
}

}  // namespace disc_shapes_test
}  // namespace mocap::geometry
