#include "trigger/unlisted_senders.h"

#include <fmt/format.h>

#include <utility>

#include "trigger/ip4.h"

namespace mocap::trigger {
namespace {

constexpr std::size_t kMaxAddresses = 64;
constexpr Duration kQuiet = std::chrono::minutes(1);
constexpr std::uint32_t kOthers = 0;

}  // namespace

UnlistedSenders::Count& UnlistedSenders::count_of(std::uint32_t address, Timestamp now) {
  if (counts_.size() >= kMaxAddresses && !counts_.contains(address)) {
    std::erase_if(counts_, [&](const auto& each) { return now - each.second.logged_at > kQuiet; });
    if (counts_.size() >= kMaxAddresses) address = kOthers;
  }
  return counts_.try_emplace(address, Count{0, now - 2 * kQuiet}).first->second;
}

std::optional<std::string> UnlistedSenders::note(std::uint32_t address, Timestamp now) {
  Count& count = count_of(address, now);
  ++count.unlogged;
  if (now - count.logged_at <= kQuiet) return std::nullopt;
  count.logged_at = now;
  const std::uint64_t packets = std::exchange(count.unlogged, 0);
  const auto found = counts_.find(kOthers);
  const bool others = found != counts_.end() && &found->second == &count;
  return fmt::format("refused {} from {}, not in [trigger] senders",
                     packets == 1 ? std::string("a packet") : fmt::format("{} packets", packets),
                     others ? std::string("further addresses") : address_text(address));
}

}  // namespace mocap::trigger
