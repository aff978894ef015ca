#include "pose/set_interval.h"

#include <gtest/gtest.h>

namespace mocap::pose {
namespace set_interval_test {

TEST(SetInterval, AConstantRateHasTheFullGain) {
  SetInterval interval;
  EXPECT_EQ(interval.gain_factor(0.01), 1.0);
  for (int set = 0; set < 50; ++set) {
    interval.add(0.01);
    EXPECT_EQ(interval.gain_factor(0.01), 1.0);
  }
}

TEST(SetInterval, ASetShortlyAfterAnotherHasItsShareOfTheGain) {
  SetInterval interval;
  for (int set = 0; set < 200; ++set) {
    interval.add(0.0005);
    interval.add(0.0095);
  }

  EXPECT_NEAR(interval.gain_factor(0.0005), 0.05, 0.01);
  EXPECT_GT(interval.gain_factor(0.0095), 0.95);
}

TEST(SetInterval, AGapDoesNotBecomeUsual) {
  SetInterval interval;
  for (int set = 0; set < 50; ++set) interval.add(0.01);
  interval.add(0.4);

  EXPECT_GT(interval.gain_factor(0.01), 0.9);
}

TEST(SetInterval, AnotherRateBecomesUsual) {
  SetInterval interval;
  for (int set = 0; set < 50; ++set) interval.add(0.01);

  for (int set = 0; set < 200; ++set) interval.add(0.002);

  EXPECT_GT(interval.gain_factor(0.002), 0.8);
}

}  // namespace set_interval_test
}  // namespace mocap::pose
