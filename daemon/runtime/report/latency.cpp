#include "runtime/report/latency.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mocap::runtime {

std::size_t LatencyHistogram::bucket_of(std::uint64_t ns) noexcept {
  if (ns < kPerOctave) return static_cast<std::size_t>(ns);
  const auto octave = static_cast<std::size_t>(std::bit_width(ns)) - 4;  // 16 to 31 give octave 1
  const std::size_t within = static_cast<std::size_t>(ns >> (octave - 1)) - kPerOctave;
  return std::min(octave * kPerOctave + within, kBuckets - 1);
}

std::uint64_t LatencyHistogram::upper_end(std::size_t bucket) noexcept {
  if (bucket < kPerOctave) return bucket;
  const std::size_t octave = bucket / kPerOctave;
  const std::uint64_t first = (kPerOctave + bucket % kPerOctave) << (octave - 1);
  return first + (std::uint64_t{1} << (octave - 1)) - 1;
}

void LatencyHistogram::add(Duration span) noexcept {
  const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(span.count(), 0));
  ++counts_[bucket_of(ns)];
  ++total_;
  max_ns_ = std::max(max_ns_, ns);
}

void LatencyHistogram::clear() noexcept { *this = LatencyHistogram{}; }

Duration LatencyHistogram::quantile(double share) const noexcept {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total_)));
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    seen += counts_[bucket];
    if (seen >= wanted && seen > 0) {
      return Duration{static_cast<std::int64_t>(std::min(upper_end(bucket), max_ns_))};
    }
  }
  return Duration{0};
}

LatencyFigures LatencyHistogram::figures() const noexcept {
  return {total_, quantile(0.50), quantile(0.99), Duration{static_cast<std::int64_t>(max_ns_)}};
}

void StageLatency::add(LatencyStage stage, Duration span) noexcept {
  stages_[static_cast<std::size_t>(stage)].add(span);
  LatencyTotals& totals = totals_[static_cast<std::size_t>(stage)];
  const auto bucket = std::ranges::lower_bound(kLatencyBounds, span) - kLatencyBounds.begin();
  ++totals.counts[static_cast<std::size_t>(bucket)];
  totals.sum += std::max(span, Duration{0});
}

void StageLatency::add(const Instants& t) noexcept {
  const auto between = [this](LatencyStage stage, std::optional<Timestamp> from, std::optional<Timestamp> to) {
    if (from && to) add(stage, *to - *from);
  };
  between(LatencyStage::Receive, t.exposed_at, t.received_at);
  between(LatencyStage::Detect, t.received_at, t.detected_at);
  between(LatencyStage::Fuse, t.detected_at, t.fused_at);
  between(LatencyStage::Send, t.fused_at, t.sent_at);
  between(LatencyStage::Total, t.exposed_at, t.sent_at);
}

std::array<LatencyFigures, kLatencyStages> StageLatency::take() noexcept {
  std::array<LatencyFigures, kLatencyStages> figures;
  for (std::size_t i = 0; i < kLatencyStages; ++i) {
    figures[i] = stages_[i].figures();
    stages_[i].clear();
  }
  return figures;
}

}  // namespace mocap::runtime
