#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/time.h"

namespace mocap::trigger {

/// Counts the packets of senders that are not permitted, and words them for the log: each address at once, then at most
/// once a minute with its count. Over 64 addresses the others are counted together.
class UnlistedSenders {
 public:
  /// A packet came. Returns the line for the log, if it is time for one.
  std::optional<std::string> note(std::uint32_t address, Timestamp now);

 private:
  struct Count {
    std::uint64_t unlogged = 0;  // packets since the last line
    Timestamp logged_at;
  };
  Count& count_of(std::uint32_t address, Timestamp now);

  std::map<std::uint32_t, Count> counts_;  // by address; 0: all others
};

}  // namespace mocap::trigger
