#include "pose/smooth_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::pose {
namespace smooth_settings_test {

TEST(SmoothSettings, HaveDefaultsWithinTheirRanges) {
  const SmoothSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace smooth_settings_test
}  // namespace mocap::pose
