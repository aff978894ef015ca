#include "synchronise/align_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::synchronise {
namespace align_settings_test {

TEST(AlignSettings, HaveDefaultsWithinTheirRanges) {
  const AlignSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(AlignSettings, RejectAnEmptyWindow) {
  AlignSettings align;
  align.window = Duration{0};

  ASSERT_EQ(check_keys(align).size(), 1U);
  EXPECT_EQ(check_keys(align)[0].message, "window_us is 0, expected 1 to 1000000");
}

}  // namespace align_settings_test
}  // namespace mocap::synchronise
