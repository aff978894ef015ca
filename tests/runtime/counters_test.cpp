#include "runtime/report/counters.h"

#include <gtest/gtest.h>

namespace mocap::runtime {
namespace counters_test {

TEST(Counter, AddsOneUnlessGivenANumber) {
  Counter counter;

  counter.add();
  counter.add(41);
  counter.add(0);

  EXPECT_EQ(counter.read(), 42U);
}

TEST(Gauge, HoldsTheLastValueOnly) {
  Gauge gauge;
  EXPECT_EQ(gauge.read(), 0.0);

  gauge.set(3.0);
  gauge.set(-0.5);

  EXPECT_EQ(gauge.read(), -0.5);
}

TEST(DetectionCounters, AddTheCountsOfEachImageAndHoldTheLevelsOfTheLast) {
  DetectionCounters counters;
  Detection image;
  image.blobs.resize(3);
  image.too_small = 1;
  image.too_large = 10;
  image.not_round = 100;
  image.too_dim = 1'000;
  image.dropped = 10'000;
  image.rows_given_up = 100'000;
  image.threshold_grey = 40.0;

  counters.add(image);
  image.blobs.resize(1);
  image.threshold_grey = 38.0;
  image.noise_grey = 2.0;
  image.background_grey = 12.0;
  counters.add(image);

  const DetectionCounts counts = counters.counts();
  EXPECT_EQ(counts.blobs, 4U);
  EXPECT_EQ(counts.too_small, 2U);
  EXPECT_EQ(counts.too_large, 20U);
  EXPECT_EQ(counts.not_round, 200U);
  EXPECT_EQ(counts.too_dim, 2'000U);
  EXPECT_EQ(counts.dropped, 20'000U);
  EXPECT_EQ(counts.rows_given_up, 200'000U);
  EXPECT_EQ(counters.levels().threshold_grey, 38.0);
  EXPECT_EQ(counters.levels().noise_grey, 2.0);
  EXPECT_EQ(counters.levels().background_grey, 12.0);
}

}  // namespace counters_test
}  // namespace mocap::runtime
