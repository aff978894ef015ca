#include "trigger/repeat_memory.h"

#include <algorithm>
#include <ranges>

namespace mocap::trigger {
namespace {

constexpr Duration kKept = std::chrono::seconds(60);
// A take has two requests: 17 takes a second for 60 s. An entry has at most three packets of kMaxPacket_bytes.
constexpr std::size_t kMaxEntries = 2048;

bool same(const Request& one, const Request& other) {
  return one.verb == other.verb && one.dialect == other.dialect && one.packet_id == other.packet_id &&
         one.name == other.name && one.slate == other.slate;
}

}  // namespace

RepeatMemory::Entry* RepeatMemory::find(std::uint32_t address, const Request& request, Timestamp now) {
  for (Entry& entry : entries_ | std::views::reverse) {
    if (now - entry.at > kKept) break;
    if (entry.address == address && same(entry.request, request)) return &entry;
  }
  return nullptr;
}

RepeatMemory::Entry* RepeatMemory::find(std::uint64_t id) {
  const auto found = std::ranges::find(entries_, id, &Entry::id);
  return found != entries_.end() ? &*found : nullptr;
}

std::uint64_t RepeatMemory::add(std::uint32_t address, const Request& request, Timestamp now) {
  while (!entries_.empty() && (now - entries_.front().at > kKept || entries_.size() >= kMaxEntries)) {
    entries_.pop_front();
  }
  entries_.push_back({++ids_, address, request, now, {}});
  return ids_;
}

void RepeatMemory::forget(std::uint64_t id) {
  std::erase_if(entries_, [&](const Entry& entry) { return entry.id == id; });
}

}  // namespace mocap::trigger
