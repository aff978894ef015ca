#pragma once

#include <array>
#include <cstdint>

#include "base/time.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::runtime {

/// Spans of time, sorted into buckets of 1/16 of their power of two: figures are right to 6 %, the maximum exactly.
/// One thread.
class LatencyHistogram {
 public:
  /// Negative spans (clocks that disagree) count as zero.
  void add(Duration span) noexcept;
  void clear() noexcept;

  /// A quantile is the upper end of the bucket it falls in, or the maximum where that is less.
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

/// How long the light of each snapshot took from instant to instant.
class StageLatency {
 public:
  /// Adds what the snapshot's instants tell; absent ones tell nothing.
  void add(const Instants& instants) noexcept;

  /// The figures since the last call, and begins anew.
  std::array<LatencyFigures, kLatencyStages> take() noexcept;

 private:
  std::array<LatencyHistogram, kLatencyStages> stages_;
};

}  // namespace mocap::runtime
