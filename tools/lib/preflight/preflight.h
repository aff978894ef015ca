#pragma once

#include <optional>
#include <vector>

#include "lib/preflight/finding.h"
#include "mocap/v1/control.pb.h"
#include "mocap/v1/description.pb.h"

namespace mocap::preflight {

/// The findings about daemon and machine before a recording begins.
struct PreflightFacts {
  v1::Status before;  ///< a few seconds before `now`, so that counters tell what happens now
  v1::Status now;
  v1::Description description;
  std::optional<double> free_minutes;          ///< of recording, on the disk of the takes; empty: unknown
  std::optional<double> calibration_age_days;  ///< of the rig file; empty: unknown
};

/// Checks whether the running daemon is ready to record: one finding for each check, those of a camera or subject with
/// its name. Pure.
std::vector<Finding> examine_daemon(const PreflightFacts& facts);

}  // namespace mocap::preflight
