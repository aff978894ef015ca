#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "runtime/pipeline.h"

namespace mocap::runtime {

/// Counts of a run since its start.
struct RunTotals {
  std::vector<std::uint64_t> frames;  ///< by CameraId
  std::uint64_t sets = 0;
  std::uint64_t complete_sets = 0;
  std::uint64_t sent = 0;
  std::uint64_t dropped = 0;  ///< frames, sets and snapshots dropped at full queues or skipped by late threads
  std::vector<std::string> failed_recordings;  ///< paths
  std::vector<std::string> cameras = {};       ///< names, by CameraId
  std::vector<BlobUse> blob_use = {};          ///< by CameraId
};

RunTotals totals_of(const Pipeline& pipeline);

/// Returns the status for `systemctl status`: "cameras=7 of 8 sets=200.0/s complete=99.5% sent=200.0/s dropped=0".
/// Rates and percentages refer to the time `span` (more than 0) between `before` and `now`; `cameras` counts the
/// cameras that delivered images in this time. `dropped` refers to the whole run. A recording that failed is added:
/// " recording 'take.jsonl' failed", and a camera that contributes nothing: " camera 'cam2': 0 % of its blobs ...".
std::string status_line(const RunTotals& before, const RunTotals& now, Duration span);

/// Returns the counts of the whole run: "sets=12000 complete=11990 sent=12000 dropped=0".
std::string summary_line(const RunTotals& totals);

}  // namespace mocap::runtime
