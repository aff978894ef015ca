#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/result.h"
#include "chaos/episode.h"
#include "model/snapshot.h"

namespace mocap::chaos {

/// An invariant that does not hold.
struct Failure {
  std::string invariant;
  std::string words;
  double t_s = 0.0;        ///< virtual time
  std::uint64_t step = 0;  ///< snapshots before
};

struct Verdict {
  std::optional<Failure> failure;
  std::uint64_t hash = 0;  ///< of everything that was published
  std::uint64_t sets = 0;
};

/// For tests: defects that are put in between the steps.
struct Sabotage {
  std::function<void(Snapshot& snapshot)> snapshot;
  std::function<void(const std::filesystem::path& take)> take;
};

/// Runs the daemon's steps through an episode and checks every invariant after each step. Ends at the first one that
/// does not hold. Takes are written into a new folder below `folder`, which is removed. Fails if the stage or the
/// folder cannot be made.
Result<Verdict> run_episode(const Episode& episode, const std::filesystem::path& folder, const Sabotage& sabotage = {});

/// As run_episode, twice: both must publish the same.
Result<Verdict> run_twice(const Episode& episode, const std::filesystem::path& folder, const Sabotage& sabotage = {});

}  // namespace mocap::chaos
