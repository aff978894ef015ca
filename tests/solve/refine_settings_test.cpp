#include "solve/refine_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::solve {
namespace refine_settings_test {

TEST(RefineSettings, HaveDefaultsWithinTheirRanges) {
  const RefineSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace refine_settings_test
}  // namespace mocap::solve
