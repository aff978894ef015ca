#include "scene/there_and_back.h"

#include <gtest/gtest.h>

namespace mocap::scene {
namespace there_and_back_test {

TEST(ThereAndBack, ReachesBothEndsWithBoundedAcceleration) {
  for (const double length_s : {0.4, 2.0, 7.0}) {
    constexpr double kStep_s = 1e-3;
    double low_s = 1e9, high_s = -1e9, max_speed = 0.0, max_acceleration = 0.0;
    for (double t_s = 0.0; t_s < 5.0 * length_s + 5.0; t_s += kStep_s) {
      const double before = there_and_back_s(t_s, length_s), at = there_and_back_s(t_s + kStep_s, length_s),
                   after = there_and_back_s(t_s + 2.0 * kStep_s, length_s);
      low_s = std::min(low_s, at);
      high_s = std::max(high_s, at);
      max_speed = std::max(max_speed, std::abs(at - before) / kStep_s);
      max_acceleration = std::max(max_acceleration, std::abs(after - 2.0 * at + before) / (kStep_s * kStep_s));
    }
    EXPECT_NEAR(low_s, 0.0, 1e-5) << length_s;
    EXPECT_NEAR(high_s, length_s, 1e-5) << length_s;
    EXPECT_NEAR(max_speed, 1.0, 1e-6) << length_s;
    // From speed 1 to speed -1 within a reversal.
    EXPECT_NEAR(max_acceleration, 2.0 / std::min(kTurnRound_s, length_s), 0.01) << length_s;
  }
}

TEST(ThereAndBack, IsZeroForAnEmptyRecordingAndNegativeTimes) {
  EXPECT_EQ(there_and_back_s(3.0, 0.0), 0.0);
  EXPECT_EQ(there_and_back_s(-1.0, 2.0), 0.0);
}

}  // namespace there_and_back_test
}  // namespace mocap::scene
