#include "pose/smooth_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::pose {
namespace {

TEST(SmoothSettings, HaveDefaultsWithinTheirRanges) {
  const SmoothSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace
}  // namespace mocap::pose
