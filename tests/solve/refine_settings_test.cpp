#include "solve/refine_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::solve {
namespace {

TEST(RefineSettings, HaveDefaultsWithinTheirRanges) {
  const RefineSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace
}  // namespace mocap::solve
