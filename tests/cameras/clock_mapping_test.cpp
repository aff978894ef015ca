#include "cameras/clock/clock_mapping.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>

#include "cameras/clock/leap_counter.h"
#include "module/stream_counters.h"

namespace mocap::cameras {
namespace clock_mapping_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

// A camera whose clock has an offset and a drift, and a transfer to the host with exponential delay.
struct World {
  double rate_hz = 120.0;
  double drift = 50e-6;  // excess seconds of the camera clock per second
  Duration offset = milliseconds(5);
  Duration least_delay{};
  double jitter_s = 2e-3;
  std::mt19937_64 random{17};

  Timestamp truth(int k) const { return from_ns(1'000'000'000'000) + from_s(k / rate_hz); }
  Duration stamp(int k) const { return from_s(k / rate_hz * (1.0 + drift)) + offset + seconds(100); }
  Timestamp receipt(int k) {
    return truth(k) + least_delay + from_s(std::exponential_distribution<>(1.0 / jitter_s)(random));
  }
};

// Rms error of the mapped times from second `from_second` to second `to_second`.
double rms_error_us(ClockMapping& mapping, World& world, double from_second, double to_second) {
  double sum = 0.0;
  int count = 0;
  for (int k = 0; k < static_cast<int>(to_second * world.rate_hz); ++k) {
    const Timestamp mapped = mapping.map(world.stamp(k), world.receipt(k));
    if (k < from_second * world.rate_hz) continue;
    const double error = to_us(mapped - world.truth(k));
    sum += error * error;
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(ClockMapping, FindsTheTruthUnderJitterAndDriftAfterTenSeconds) {
  World world;
  ClockMapping mapping;

  const double rms_us = rms_error_us(mapping, world, 10.0, 60.0);

  EXPECT_LT(rms_us, 50.0);  // 2 % of the jitter
  EXPECT_NEAR(mapping.drift(), -50e-6, 10e-6);
  RecordProperty("rms_us", std::to_string(rms_us));
}

TEST(ClockMapping, IsAccurateUnderOtherLawsOfDelay) {
  std::mt19937_64 random(23);
  std::uniform_real_distribution<> even(0.0, 4e-3);
  std::normal_distribution<> normal(0.0, 2e-3);
  for (const bool uniform : {true, false}) {
    World world;
    ClockMapping mapping;
    double sum = 0.0;
    for (int k = 0; k < 7200; ++k) {
      const double delay_s = uniform ? even(random) : std::abs(normal(random));
      const double error_us = to_us(mapping.map(world.stamp(k), world.truth(k) + from_s(delay_s)) - world.truth(k));
      if (k >= 1200) sum += error_us * error_us / 6000.0;
    }
    EXPECT_LT(std::sqrt(sum), 50.0) << (uniform ? "uniform" : "half-normal");
  }
}

TEST(ClockMapping, KnowsHowUncertainItIs) {
  for (const double rate_hz : {30.0, 120.0}) {
    double error_square = 0.0, estimate_square = 0.0;
    for (std::uint64_t run = 0; run < 20; ++run) {
      World world{.rate_hz = rate_hz, .random = std::mt19937_64(100 + run)};
      ClockMapping mapping;
      for (int k = 0; k < static_cast<int>(12.0 * rate_hz); ++k) {
        const double error_us = to_us(mapping.map(world.stamp(k), world.receipt(k)) - world.truth(k));
        if (k < static_cast<int>(10.0 * rate_hz)) continue;
        error_square += error_us * error_us;
        estimate_square += std::pow(to_us(mapping.uncertainty()), 2);
      }
    }
    const double estimate_over_true = std::sqrt(estimate_square / error_square);
    EXPECT_GT(estimate_over_true, 0.7) << rate_hz;  // 20 runs estimate the error within about 20 %
    EXPECT_LT(estimate_over_true, 3.0) << rate_hz;
  }
}

TEST(ClockMapping, KeepsTheDriftOverAWrapOfTheCounter) {
  World world;
  ClockMapping mapping;
  rms_error_us(mapping, world, 0.0, 30.0);
  const Duration wrap = from_s(34.359738368);  // 2^32 ticks of 125 MHz

  double sum = 0.0;
  int count = 0;
  for (int k = 3600; k < 3600 + 600; ++k) {
    const double error_us = to_us(mapping.map(world.stamp(k) - wrap, world.receipt(k)) - world.truth(k));
    if (k < 3600 + 120) continue;
    sum += error_us * error_us;
    ++count;
  }

  EXPECT_EQ(mapping.leaps(), 1U);
  // 1 s after the wrap the smallest of 120 delays of 2 ms is about 17 us, and the drift is known.
  EXPECT_LT(std::sqrt(sum / count), 50.0);
}

TEST(ClockMapping, CountsACounterThatBeginsToStandStillOnceAndFindsItAgain) {
  World world{.jitter_s = 1e-4};
  ClockMapping mapping;
  rms_error_us(mapping, world, 0.0, 20.0);

  for (int k = 2400; k < 2600; ++k) mapping.map(world.stamp(2399), world.receipt(k));
  EXPECT_TRUE(mapping.stands_still());
  EXPECT_EQ(mapping.leaps(), 1U);
  const Duration lost = world.stamp(2600) - world.stamp(2400);
  double worst_us = 0.0;
  for (int k = 2600; k < 3200; ++k) {
    const Timestamp mapped = mapping.map(world.stamp(k) - lost, world.receipt(k));
    if (k >= 2720) worst_us = std::max(worst_us, std::abs(to_us(mapped - world.truth(k))));
  }

  EXPECT_FALSE(mapping.stands_still());
  EXPECT_LT(worst_us, 50.0);
}

TEST(ClockMapping, LeavesTheLeastDelayToTheCaller) {
  World world;
  world.least_delay = microseconds(700);
  ClockMapping mapping;

  double sum_us = 0.0;
  for (int k = 0; k < 3600; ++k) {
    const Timestamp mapped = mapping.map(world.stamp(k), world.receipt(k));
    if (k >= 1200) sum_us += to_us(mapped - world.truth(k)) / 2400.0;
  }

  EXPECT_NEAR(sum_us, 700.0, 50.0);
}

TEST(ClockMapping, IsExactFromTheFirstFrameWithoutJitter) {
  World world{.rate_hz = 60.0, .drift = 0.0, .jitter_s = 1e-12};
  ClockMapping mapping;

  for (int k = 0; k < 6000; ++k) {
    const Timestamp mapped = mapping.map(world.stamp(k), world.receipt(k));
    ASSERT_NEAR(to_us(mapped - world.truth(k)), 0.0, 0.01) << k;  // rounding of double over 100 s
  }
}

TEST(ClockMapping, NeverReturnsATimeAfterTheReceipt) {
  World world{.jitter_s = 5e-3};
  ClockMapping mapping;

  for (int k = 0; k < 5000; ++k) {
    const Timestamp received = world.receipt(k);
    ASSERT_LE(mapping.map(world.stamp(k), received), received);
  }
}

TEST(ClockMapping, GivesTheTimeOfReceiptWhenTheClockStandsStill) {
  World world;
  ClockMapping mapping;

  for (int k = 0; k < 100; ++k) {
    const Timestamp received = world.receipt(k);
    ASSERT_EQ(mapping.map(seconds(7), received), received);
  }
}

TEST(ClockMapping, StartsAnewWhenTheCounterLeapsEitherWay) {
  for (const Duration leap : {Duration(seconds(3600)), Duration(-seconds(50)), Duration(milliseconds(300))}) {
    World world{.jitter_s = 1e-4};
    ClockMapping mapping;
    rms_error_us(mapping, world, 0.0, 20.0);

    double worst_us = 0.0;
    for (int k = 2400; k < 4800; ++k) {
      const Timestamp mapped = mapping.map(world.stamp(k) + leap, world.receipt(k));
      if (k >= 2400 + 600) worst_us = std::max(worst_us, std::abs(to_us(mapped - world.truth(k))));
    }

    EXPECT_LT(worst_us, 200.0) << to_s(leap) << " s: twice the mean jitter five seconds after the leap";
  }
}

TEST(ClockMapping, StartsAnewWhenTheCounterFallsBehindForGood) {
  // The stamps jump back by less than they advance, so only the increasing delay shows the jump.
  World world{.rate_hz = 10.0, .jitter_s = 1e-4};
  ClockMapping mapping;
  rms_error_us(mapping, world, 0.0, 20.0);

  double worst_us = 0.0;
  for (int k = 200; k < 400; ++k) {
    const Timestamp mapped = mapping.map(world.stamp(k) - milliseconds(60), world.receipt(k));
    if (k >= 250) worst_us = std::max(worst_us, std::abs(to_us(mapped - world.truth(k))));
  }

  EXPECT_LT(worst_us, 500.0);
}

TEST(ClockMapping, SurvivesASecondOfStalledDelivery) {
  World world{.jitter_s = 1e-4};
  ClockMapping mapping;
  rms_error_us(mapping, world, 0.0, 20.0);

  double worst_us = 0.0;
  for (int k = 2400; k < 2400 + 240; ++k) {
    const Timestamp received = k < 2520 ? std::max(world.receipt(k), world.truth(2520)) : world.receipt(k);
    const Timestamp mapped = mapping.map(world.stamp(k), received);
    worst_us = std::max(worst_us, std::abs(to_us(mapped - world.truth(k))));
  }

  EXPECT_LT(worst_us, 50.0);
}

TEST(LeapCounter, CountsEachJumpOnceAlsoIfTheClockBeginsAnew) {
  StreamCounters counters;
  LeapCounter leaps;

  for (const std::uint64_t so_far : {0U, 2U, 2U, 3U, 0U, 1U}) leaps.count(so_far, counters);

  EXPECT_EQ(counters.clock_leaps, 4U);
}

TEST(LeapCounter, NeverCountsAJumpThatWasSkipped) {
  StreamCounters counters;
  LeapCounter leaps;

  leaps.skip(3);
  leaps.count(4, counters);

  EXPECT_EQ(counters.clock_leaps, 1U);
}

}  // namespace clock_mapping_test
}  // namespace mocap::cameras
