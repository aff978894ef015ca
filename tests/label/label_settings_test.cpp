#include "label/label_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::label {
namespace label_settings_test {

TEST(LabelSettings, HaveDefaultsWithinTheirRanges) {
  const LabelSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace label_settings_test
}  // namespace mocap::label
