#include "detect/detect_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::detect {
namespace detect_settings_test {

TEST(DetectSettings, HaveDefaultsWithinTheirRanges) {
  const DetectSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(DetectSettings, HaveNoBrokenRuleByDefault) { EXPECT_TRUE(faults_of(DetectSettings{}).empty()); }

TEST(DetectSettings, RefuseAMinimumAreaAboveTheMaximum) {
  const DetectSettings detect{.min_area_px2 = 9.0, .max_area_px2 = 8.0};

  const std::vector<KeyFault> faults = faults_of(detect);

  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "min_area_px2");
}

TEST(DetectSettings, RefuseALowThresholdAboveTheThreshold) {
  DetectSettings detect{.threshold = 50.0, .low_threshold = 50.0};
  EXPECT_TRUE(faults_of(detect).empty());

  detect.low_threshold = 51.0;

  ASSERT_EQ(faults_of(detect).size(), 1U);
  EXPECT_EQ(faults_of(detect)[0].key, "low_threshold");
}

}  // namespace detect_settings_test
}  // namespace mocap::detect
