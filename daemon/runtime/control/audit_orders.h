#pragma once

#include "model/audit.h"
#include "model/control.h"
#include "model/take/take_health.h"

namespace mocap::runtime {

/// The entry of an order of an operator: its words as mocapctl has them, its values, and the outcome.
AuditEntry entry_of(const ControlRequest& order, const ControlAnswer& answer);

/// The entry of an order of a remote trigger.
AuditEntry entry_of(const TakeOrder& order);

/// The entry of a take that began or ended.
AuditEntry entry_of(const TakeHealth& take, const AuditActor& who);

}  // namespace mocap::runtime
