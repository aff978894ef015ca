#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "lib/retrack/chunk.h"
#include "lib/retrack/take_settings.h"

namespace mocap::retrack {

struct RetrackOrder {
  std::filesystem::path take = {};
  std::filesystem::path out = {};  ///< the new take; ends in .mcap
  OtherFiles others = {};
  /// The part that the new take has, after the start of the take. Tracking begins at the start of the take in any case.
  std::optional<Duration> from = {}, to = {};
  std::optional<Chunk> chunk = {};  ///< only this chunk is tracked, into `chunk_file`; without `from` and `to`
  bool offline = false;    ///< tracked forwards and backwards: subjects from the start on, gaps filled from both sides
  bool every_set = false;  ///< sets are formed anew of all images, instead of those that the daemon fused
  bool resume = false;  ///< if the new take or chunk is there, whole and made of the same (`made_of`), nothing is done
};

struct RetrackProgress {
  double share = 0.0;  ///< 0 to 1
  std::uint64_t sets = 0;
};

struct RetrackReport {
  std::string path;
  std::uint64_t sets = 0;
  double seconds = 0.0;                           ///< of the take, tracked
  std::uint64_t recorded = 0;                     ///< sets with a snapshot in the take
  std::uint64_t equal = 0;                        ///< of these: the new snapshot is the same, byte for byte
  std::optional<std::uint64_t> first_difference;  ///< number of the first set that is not
  std::uint64_t missing_views = 0;                ///< images of sets that the take does not have
  std::uint64_t damaged = 0;                      ///< messages that were left out
  bool from_start_of_run = false;                 ///< the take has the first set of its run
  bool from_belief = false;                       ///< the tracking began with the belief that the take begins with
  bool kept = false;                              ///< the new take was there already: nothing was tracked
};

/// Called about once in 100 sets. False: the work ends, no new take is left.
using GoOn = std::function<bool(const RetrackProgress&)>;

/// Tracks a take again with the parts of the daemon, and writes a new take. Reads no clock: the same take and settings
/// give the same snapshots. The new take has its name once it is whole (PartFile).
///
/// Fails as TakeReader::open, load_take_settings and NewTake::create do, with InvalidArgument if the new file exists
/// (and is not what `resume` is for), if the take has no images, or if the settings have none of its cameras, and with
/// EndOfStream if `progress` ended the work.
Result<RetrackReport> retrack(const RetrackOrder& order, const GoOn& progress);

}  // namespace mocap::retrack
