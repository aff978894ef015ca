#pragma once

#include <cstdint>
#include <filesystem>

#include "base/key_visitor.h"

namespace mocap::audit {

/// [audit]: the log of connections, orders and changes. Help: the table in audit_settings.cpp.
struct AuditSettings {
  bool on = true;
  std::filesystem::path file = "audit.jsonl";  ///< empty: no log
  std::uint64_t max_mb = 16;
  std::uint32_t keep = 8;

  bool writes() const { return on && !file.empty(); }
  friend bool operator==(const AuditSettings&, const AuditSettings&) = default;
};

void declare_keys(KeyVisitor& keys, AuditSettings& audit);

}  // namespace mocap::audit
