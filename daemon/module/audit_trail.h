#pragma once

#include "base/time.h"
#include "model/audit.h"

namespace mocap {

/// Receives the entries of the audit log. Any thread may call.
class AuditTrail {
 public:
  virtual ~AuditTrail() = default;

  /// Notes an entry with the time of the call. Never waits for the disk; allocates. For connections, orders and
  /// changes, not for images or sets.
  virtual void note(AuditEntry entry) = 0;

  /// The same, and waits until the entry is on the disk, a write fails, or `patience` is over. Returns whether it is on
  /// the disk. For an order that is about to be answered.
  virtual bool write(AuditEntry entry, Duration patience) = 0;

  virtual AuditHealth health() const = 0;
};

}  // namespace mocap
