#pragma once

#include <cstddef>
#include <string>

#include "model/audit.h"

namespace mocap::audit {

/// Longest value of an entry; the rest is replaced by "...".
inline constexpr std::size_t kLongestValue = 1000;

/// An entry as one line of JSON with its newline: "at" (UTC, RFC 3339), "what", "who", then the other parts that are
/// not empty. All values are strings. "who" is the name of the actor, otherwise its key, its address without port, or
/// "mocapd". Bytes that are not printable ASCII or valid UTF-8 cannot leave their string.
std::string to_line(const AuditEntry& entry);

}  // namespace mocap::audit
