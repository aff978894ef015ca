#include "drift/drift_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::drift {
namespace drift_settings_test {

TEST(DriftSettings, HaveDefaultsWithinTheirRanges) {
  const DriftSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace drift_settings_test
}  // namespace mocap::drift
