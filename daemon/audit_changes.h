#pragma once

#include <vector>

#include "model/audit.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// The entries "changed" and "calibrated" of the audit log between two configurations: each setting with its value
/// before and after, each camera whose calibration changed with how far it moved and turned, and each camera whose
/// learnt masks changed.
std::vector<AuditEntry> audit_changes(const settings::DaemonSettings& before, const settings::DaemonSettings& now);

}  // namespace mocap
