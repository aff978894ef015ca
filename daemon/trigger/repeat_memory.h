#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "base/time.h"
#include "trigger/request.h"

namespace mocap::trigger {

/// The requests of the last 60 s with their answers, so that a packet that arrives twice is executed once: a sender
/// repeats it because an answer was lost, or a network has two paths.
class RepeatMemory {
 public:
  struct Entry {
    std::uint64_t id = 0;  ///< of this entry
    std::uint32_t address = 0;
    Request request;
    Timestamp at;  ///< arrival of the first packet
    std::vector<std::string> answers;
  };

  /// The last request of this sender with the same verb, PacketID, name and slate, at most 60 s ago; null: none. Valid
  /// until the next call of a method that is not const.
  Entry* find(std::uint32_t address, const Request& request, Timestamp now);
  /// The entry with this id; null: it is forgotten.
  Entry* find(std::uint64_t id);

  /// Remembers a request; forgets the oldest over 2048. Returns the id of its entry.
  std::uint64_t add(std::uint32_t address, const Request& request, Timestamp now);
  void forget(std::uint64_t id);

 private:
  std::deque<Entry> entries_;  // by time
  std::uint64_t ids_ = 0;
};

}  // namespace mocap::trigger
