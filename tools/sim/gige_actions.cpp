#include "gige_actions.h"

#include <algorithm>

namespace mocap::sim {
namespace {

constexpr std::uint8_t kScheduled = 0x80;

std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t each : bytes) value = value << 8 | each;
  return value;
}

}  // namespace

GigeActions::Answer GigeActions::take(std::uint8_t flags, std::span<const std::uint8_t> data, const ActionKeys& keys,
                                      const CameraClock& clock, std::int64_t arrived_utc_ns) {
  if (data.size() < 12) return Answer::NotForUs;
  const bool ours = big_endian(data.first(4)) == keys.device && big_endian(data.subspan(4, 4)) == keys.group &&
                    (big_endian(data.subspan(8, 4)) & keys.mask) != 0;
  if (!ours) return Answer::NotForUs;
  const bool scheduled = (flags & kScheduled) != 0 && data.size() >= 20;
  if (scheduled && !clock.follows_utc()) return Answer::NoReferenceTime;
  const std::int64_t at_utc_ns =
      scheduled ? clock.utc_ns(static_cast<std::int64_t>(big_endian(data.subspan(12, 8)))) : arrived_utc_ns;

  const std::scoped_lock lock(mutex_);
  if (due_utc_ns_.size() >= kQueue) return Answer::Overflow;
  const std::int64_t due_utc_ns = std::max(at_utc_ns, arrived_utc_ns);
  due_utc_ns_.insert(std::upper_bound(due_utc_ns_.begin(), due_utc_ns_.end(), due_utc_ns), due_utc_ns);
  command_added_.notify_one();
  return at_utc_ns < arrived_utc_ns ? Answer::Late : Answer::Done;
}

std::optional<std::int64_t> GigeActions::next_utc_ns(Duration patience) {
  std::unique_lock lock(mutex_);
  if (!command_added_.wait_for(lock, patience, [&] { return !due_utc_ns_.empty(); })) return std::nullopt;
  const std::int64_t next = due_utc_ns_.front();
  due_utc_ns_.pop_front();
  return next;
}

void GigeActions::clear() {
  const std::scoped_lock lock(mutex_);
  due_utc_ns_.clear();
}

}  // namespace mocap::sim
