#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "chaos/run_episode.h"

namespace mocap::chaos {

struct BatchSettings {
  std::uint64_t first = 1;
  std::uint64_t last = 1;  ///< included
  int jobs = 2;            ///< processes at once
  std::filesystem::path folder;
  std::optional<Duration> no_start_after = {};  ///< no further seed is started after this time
};

struct SeedResult {
  Episode episode;
  Verdict verdict;
};

/// Runs the episodes of the seeds, each in a process of its own, and passes each result on as it comes. Returns the
/// number of seeds that ran. Fails with the first error that is no finding.
Result<std::uint64_t> run_seeds(const BatchSettings& settings, const std::function<void(const SeedResult&)>& on_result);

/// The failing episode with the fewest faults that still violate the same invariant, and its verdict.
Result<SeedResult> shrink_failure(const SeedResult& failing, const std::filesystem::path& folder);

}  // namespace mocap::chaos
