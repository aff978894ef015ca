#include "base/time.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace mocap {
namespace time_test {

TEST(Time, ConvertsAnInstantToNanosecondsAndBackExactly) {
  // UTC in nanoseconds has more digits than a double.
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1'700'000'000'123'456'789}}) {
    EXPECT_EQ(to_ns(from_ns(ns)), ns);
  }
}

TEST(Time, RoundsSecondsToTheNearestNanosecond) {
  EXPECT_EQ(from_s(1.5), std::chrono::milliseconds(1500));
  EXPECT_EQ(from_s(1.6e-9).count(), 2);
  EXPECT_EQ(from_s(-1.6e-9).count(), -2);
  EXPECT_EQ(from_s(0.4e-9).count(), 0);
}

TEST(Time, ConvertsDurationsToSecondsAndMicroseconds) {
  EXPECT_DOUBLE_EQ(to_s(std::chrono::milliseconds(-250)), -0.25);
  EXPECT_DOUBLE_EQ(to_us(Duration{1}), 1e-3);
}

TEST(HostClock, IsTheSteadyClockAndNeverRunsBackwards) {
  const auto before = std::chrono::steady_clock::now();
  const Timestamp first = host_now();
  const Timestamp second = host_now();
  const auto after = std::chrono::steady_clock::now();

  EXPECT_LE(before, first);
  EXPECT_LE(first, second);
  EXPECT_LE(second, after);
}

TEST(HostClock, PlusItsOffsetIsUtc) {
  const Duration before = std::chrono::system_clock::now().time_since_epoch();
  const Duration utc = host_now().time_since_epoch() + utc_minus_host();
  const Duration after = std::chrono::system_clock::now().time_since_epoch();

  // 0.1 s: a busy machine may delay the thread between two reads. An error of the sign would be decades.
  EXPECT_GT(utc, before - std::chrono::milliseconds(100));
  EXPECT_LT(utc, after + std::chrono::milliseconds(100));
}

}  // namespace time_test
}  // namespace mocap
