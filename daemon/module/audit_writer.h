#pragma once

#include "base/result.h"
#include "model/audit.h"

namespace mocap {

/// Writes entries of the audit log. One thread owns it.
class AuditWriter {
 public:
  virtual ~AuditWriter() = default;

  /// Appends one entry as a whole or, if that fails, not at all. May wait for the disk.
  virtual Status append(const AuditEntry& entry) = 0;

  /// Waits until the entries are on the disk.
  virtual Status sync() = 0;
};

}  // namespace mocap
