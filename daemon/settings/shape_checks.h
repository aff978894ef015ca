#pragma once

#include <string>
#include <vector>

#include "settings/cross_checks.h"

namespace mocap::settings {

/// Whether every subject can be told from itself turned and from the others by where its markers sit: things by their
/// shape in any order of markers, fitted bodies by their lengths. People who are not fitted yet may wear the same set:
/// each is fitted in its own T-pose. Makes faults of those that cannot; needs `settings.worn` of all subjects.
void check_shapes(DaemonTables& tables, const DaemonSettings& settings);

/// What is no fault but may go wrong, and what to do, a line each: people whose T-pose is to tell their measures, and
/// may be read back to front.
std::vector<std::string> shape_doubts(const DaemonSettings& settings);

}  // namespace mocap::settings
