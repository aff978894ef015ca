#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/time.h"

namespace mocap {

/// Bound on the bytes of a belief.
inline constexpr std::size_t kMostBeliefBytes = 32'000'000;
/// The time between two beliefs that are kept for takes.
inline constexpr Duration kBeliefPeriod = std::chrono::seconds(1);

/// The state of the fusion between two sets: a fusion of the same configuration that takes it over gives the same
/// snapshots from the next set on (fusion::Fusion::archive).
struct Belief {
  std::uint64_t after_set = 0;  ///< number of the last set that it knows
  Timestamp at;                 ///< exposure of that set
  std::size_t size = 0;
  /// kMostBeliefBytes, not initialised: pages that were never used cost nothing.
  std::unique_ptr<std::byte[]> memory = std::make_unique_for_overwrite<std::byte[]>(kMostBeliefBytes);

  std::span<const std::byte> bytes() const { return {memory.get(), size}; }
};

}  // namespace mocap
