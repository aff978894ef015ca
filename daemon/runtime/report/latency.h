#pragma once

#include <array>
#include <cstdint>

#include "base/time.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::runtime {

/// Histogram of durations with 16 buckets for each power of two: quantiles have at most 6 % error, the maximum is
/// exact. One thread.
class LatencyHistogram {
 public:
  /// Adds a duration. A negative duration (between clocks that disagree) counts as zero.
  void add(Duration span) noexcept;
  void clear() noexcept;

  /// Returns count, quantiles and maximum. A quantile is the upper end of its bucket, or the maximum if that is less.
  LatencyFigures figures() const noexcept;

 private:
  static constexpr std::size_t kPerOctave = 16;
  static constexpr std::size_t kBuckets = 40 * kPerOctave;  // to 2^40 ns = 18 min

  static std::size_t bucket_of(std::uint64_t ns) noexcept;
  static std::uint64_t upper_end(std::size_t bucket) noexcept;
  Duration quantile(double share) const noexcept;

  std::array<std::uint32_t, kBuckets> counts_{};
  std::uint64_t total_ = 0;
  std::uint64_t max_ns_ = 0;
};

/// Latency of each stage of the pipeline, from the instants of the snapshots.
class StageLatency {
 public:
  /// Adds the stages whose two instants are both set.
  void add(const Instants& instants) noexcept;

  /// Returns the figures since the last call and clears the histograms.
  std::array<LatencyFigures, kLatencyStages> take() noexcept;

  /// All latencies since the start.
  const std::array<LatencyTotals, kLatencyStages>& totals() const noexcept { return totals_; }

 private:
  void add(LatencyStage stage, Duration span) noexcept;

  std::array<LatencyHistogram, kLatencyStages> stages_;
  std::array<LatencyTotals, kLatencyStages> totals_;
};

}  // namespace mocap::runtime
