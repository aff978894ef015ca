#include "drift/drift_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::drift {
namespace {

TEST(DriftSettings, HaveDefaultsWithinTheirRanges) {
  const DriftSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace
}  // namespace mocap::drift
