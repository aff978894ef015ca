#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "runtime/pipeline.h"

namespace mocap::runtime {

/// What a run has counted so far.
struct RunTotals {
  std::vector<std::uint64_t> frames;  ///< by CameraId
  std::uint64_t sets = 0;
  std::uint64_t complete_sets = 0;
  std::uint64_t sent = 0;
  std::uint64_t dropped = 0;  ///< frames and snapshots that a full queue or a late thread let go
};

RunTotals totals_of(const Pipeline& pipeline);

/// How the daemon is, as `systemctl status` shows it: "cameras=7 of 8 sets=200.0/s complete=99.5% sent=200.0/s
/// dropped=0". Rates and shares are of the time between the two, `span` (more than 0); a camera counts that delivered
/// in it. Drops are of the whole run.
std::string status_line(const RunTotals& before, const RunTotals& now, Duration span);

/// "sets=12000 complete=11990 sent=12000 dropped=0": of the whole run.
std::string summary_line(const RunTotals& totals);

}  // namespace mocap::runtime
