#include "runtime/report/latency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace mocap::runtime {
namespace latency_test {

using std::chrono::microseconds;

TEST(LatencyHistogram, AgreesWithSortedSpansToSixPercent) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> spans_ns(12.0, 1.5);
  LatencyHistogram histogram;
  std::vector<std::int64_t> all;
  for (int i = 0; i < 20'000; ++i) {
    all.push_back(static_cast<std::int64_t>(spans_ns(random)));
    histogram.add(Duration{all.back()});
  }
  std::sort(all.begin(), all.end());

  const LatencyFigures figures = histogram.figures();

  EXPECT_EQ(figures.count, all.size());
  EXPECT_NEAR(static_cast<double>(figures.p50.count()), static_cast<double>(all[9'999]),
              0.0625 * static_cast<double>(all[9'999]));
  EXPECT_NEAR(static_cast<double>(figures.p99.count()), static_cast<double>(all[19'799]),
              0.0625 * static_cast<double>(all[19'799]));
  EXPECT_EQ(figures.max.count(), all.back());
}

TEST(LatencyHistogram, ClampsExtremeDurations) {
  LatencyHistogram histogram;
  histogram.add(Duration{-5});
  histogram.add(Duration::max());

  EXPECT_EQ(histogram.figures().p50, Duration{0});
  EXPECT_EQ(histogram.figures().max, Duration::max());
}

TEST(StageLatency, UsesOnlyTheInstantsThatAreSet) {
  StageLatency latency;
  Instants instants{.exposed_at = from_ns(1'000'000),
                    .received_at = {},
                    .detected_at = {},
                    .fused_at = from_ns(3'000'000),
                    .sent_at = from_ns(3'500'000)};

  latency.add(instants);
  const auto figures = latency.take();

  EXPECT_EQ(figures[static_cast<std::size_t>(LatencyStage::Receive)].count, 0U);
  EXPECT_EQ(figures[static_cast<std::size_t>(LatencyStage::Fuse)].count, 0U);
  EXPECT_EQ(figures[static_cast<std::size_t>(LatencyStage::Send)].max, microseconds(500));
  EXPECT_EQ(figures[static_cast<std::size_t>(LatencyStage::Total)].max, microseconds(2500));
  EXPECT_EQ(latency.take()[static_cast<std::size_t>(LatencyStage::Total)].count, 0U);
}

TEST(StageLatency, CountsAllSinceTheStartInBuckets) {
  StageLatency latency;
  for (const std::int64_t ns : {0LL, 250'000LL, 250'001LL, 300'000'000LL, -5LL}) {
    latency.add({.exposed_at = from_ns(1'000'000'000),
                 .received_at = from_ns(1'000'000'000 + ns),
                 .detected_at = {},
                 .fused_at = {},
                 .sent_at = {}});
  }
  static_cast<void>(latency.take());

  const LatencyTotals& totals = latency.totals()[static_cast<std::size_t>(LatencyStage::Receive)];

  EXPECT_EQ(totals.counts[0], 3U) << "up to 0.25 ms";
  EXPECT_EQ(totals.counts[1], 1U);
  EXPECT_EQ(totals.counts.back(), 1U);
  EXPECT_EQ(totals.sum, Duration(300'500'001));
}

}  // namespace latency_test
}  // namespace mocap::runtime
