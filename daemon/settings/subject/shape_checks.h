#pragma once

#include <string>
#include <vector>

#include "settings/cross_checks.h"

namespace mocap::settings {

/// Adds a fault for each subject that cannot be distinguished from another subject, or from itself after a rotation:
/// rigid bodies by the places of their markers in any order, fitted bodies by their lengths. People who are not fitted
/// yet may have the same marker set, because each is fitted in a T-pose of its own. Needs the marker sets of all
/// subjects in `settings.subject_models`.
void check_shapes(DaemonTables& tables, const DaemonSettings& settings);

/// Warnings, one sentence each with its remedy: people who are to be fitted in a T-pose and whose markers do not
/// distinguish front from back.
std::vector<std::string> shape_warnings(const DaemonSettings& settings);

}  // namespace mocap::settings
