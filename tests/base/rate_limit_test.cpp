#include "base/rate_limit.h"

#include <gtest/gtest.h>

#include <random>

namespace mocap {
namespace rate_limit_test {

using std::chrono::microseconds;

// Frames that a receiver of 60 Hz gets in 10 s of a feed.
int admitted(int feed_hz, int jitter_us) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> jitter(-jitter_us, jitter_us);
  RateLimit limit(60.0);
  int count = 0;
  const Timestamp start = Timestamp{} + std::chrono::hours(1);
  for (int i = 0; i < feed_hz * 10; ++i) {
    if (limit.admits(start + microseconds(1'000'000LL * i / feed_hz + jitter(random)))) ++count;
  }
  return count;
}

TEST(RateLimit, AdmitsEveryFrameOfASlowerOrEqualFeed) {
  EXPECT_EQ(admitted(30, 3000), 300);
  EXPECT_EQ(admitted(60, 0), 600);
  EXPECT_EQ(admitted(60, 1500), 600);
}

TEST(RateLimit, KeepsTheRateOfAFasterFeed) {
  EXPECT_NEAR(admitted(120, 1000), 600, 6);
  EXPECT_NEAR(admitted(100, 0), 600, 20);
  EXPECT_NEAR(admitted(500, 500), 600, 20);
}

TEST(RateLimit, GoesOnWhenTheTimeOfTheFeedGoesBack) {
  RateLimit limit(60.0);
  ASSERT_TRUE(limit.admits(Timestamp{} + std::chrono::hours(1)));

  EXPECT_TRUE(limit.admits(Timestamp{} + std::chrono::seconds(1)));
  EXPECT_FALSE(limit.admits(Timestamp{} + std::chrono::milliseconds(1001)));
}

}  // namespace rate_limit_test
}  // namespace mocap
