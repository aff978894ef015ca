#pragma once

#include "base/result.h"
#include "lib/farm/farm_watch.h"
#include "lib/farm/submission.h"

namespace mocap::farm {

/// Removes the exit codes of an earlier run, runs the command of a submission and waits for its end; reads which units
/// ended from their files. A unit that did not end is a failure with the path of its log.
///
/// If `stops` is over 0, the units are cancelled. Returns how many units were then left. Fails with NotFound (the
/// program is not installed: the message names the package) and with Io if the system refused the submission.
Result<std::size_t> run_submitted(const FarmOrder& order, const Submission& submission, const FarmWatch& watch);

}  // namespace mocap::farm
