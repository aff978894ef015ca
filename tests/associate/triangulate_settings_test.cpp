#include "associate/triangulate_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::associate {
namespace triangulate_settings_test {

TEST(TriangulateSettings, HaveDefaultsWithinTheirRanges) {
  const TriangulateSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(TriangulateSettings, StateTheLargestSigmaInMillimetres) {
  TriangulateSettings triangulate;
  triangulate.max_sigma_m = 2.0;

  ASSERT_EQ(check_keys(triangulate).size(), 1U);
  EXPECT_EQ(check_keys(triangulate)[0].message, "max_sigma_mm is 2000, expected 0.01 to 1000");
}

}  // namespace triangulate_settings_test
}  // namespace mocap::associate
