#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/bounded_vector.h"

namespace mocap {

/// The originator of an entry of the audit log, as far as the daemon knows. All empty: the daemon itself.
struct AuditActor {
  std::string name = {};     ///< of the client's key in the list of allowed keys, or "trigger", "SIGHUP"; empty: no key
  std::string key = {};      ///< the client's public key; empty: clients are not authenticated
  std::string address = {};  ///< "10.0.0.7:51234"; "local": a socket of this machine without an address
  std::string role = {};     ///< of the key
  std::string states = {};   ///< the person whom the client names; nobody has verified the name
};

/// One entry of the audit log.
struct AuditEntry {
  std::string what = {};  ///< a word of the table in audit/README.md
  AuditActor who = {};
  std::vector<std::pair<std::string, std::string>> details = {};  ///< name and value
  std::int64_t at_utc_ns = 0;                                     ///< set by the AuditTrail
};

/// State of the audit log. In place: a copy does not allocate.
struct AuditHealth {
  bool on = false;
  std::uint64_t lines = 0;              ///< written since the start
  std::uint64_t waiting = 0;            ///< not written yet
  std::uint64_t lost = 0;               ///< since the start: the queue was full
  BoundedVector<char, 255> error = {};  ///< why the last write failed; empty: it did not
};

}  // namespace mocap
