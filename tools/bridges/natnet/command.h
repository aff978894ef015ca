#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "bridges/natnet/settings.h"

namespace mocap::natnet {

constexpr std::int32_t kDone = 0;
constexpr std::int32_t kNotPossible = 1;

/// The command is none of NatNet, or none that this server knows.
struct Unknown {
  bool operator==(const Unknown&) const = default;
};
/// The client leaves.
struct Leave {
  bool operator==(const Leave&) const = default;
};

/// The client wants a take to start or to end.
struct Record {
  bool start = true;
  std::string name;  ///< of the take; empty: by the daemon's [takes] name

  bool operator==(const Record&) const = default;
};

/// The answer to a command: a code, a number, a text, or one of the above.
using Answer = std::variant<std::int32_t, float, std::string, Unknown, Leave, Record>;

struct CommandFacts {
  float rate_hz = 0.0F;    ///< nominal rate of the feed
  bool changeable = true;  ///< false: the settings are those of a multicast, which all its receivers share
  bool records = false;    ///< clients may start and end takes
};

/// Executes the text of a REQUEST, which is untrusted, for a client with these settings. The caller compares the
/// settings before and after.
Answer execute(std::string_view text, Settings& settings, const CommandFacts& facts);

}  // namespace mocap::natnet
