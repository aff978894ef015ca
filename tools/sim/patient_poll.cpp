#include "patient_poll.h"

#include <glib.h>
#include <poll.h>
#include <time.h>

#include <atomic>

namespace {

std::atomic<bool> streams{false};
constexpr int kWrapped_ms = 100;         // what a wait that wrapped around is cut to
constexpr long kRemainder_ns = 150'000;  // of a wait under 1 ms, which Aravis would spin away

}  // namespace

namespace mocap::sim {
void poll_for_streams(bool streaming) noexcept { streams.store(streaming, std::memory_order_relaxed); }
}  // namespace mocap::sim

extern "C" __attribute__((visibility("default"))) gint g_poll(GPollFD* fds, guint count, gint timeout_ms) {
  static_assert(sizeof(GPollFD) == sizeof(pollfd));  // GLib promises the same layout where there is poll()
  auto* const polled = reinterpret_cast<pollfd*>(fds);
  if (!streams.load(std::memory_order_relaxed)) return ::poll(polled, count, timeout_ms);
  if (timeout_ms == kWrapped_ms) return ::poll(polled, count, 1);
  if (timeout_ms != 0) return ::poll(polled, count, timeout_ms);
  const timespec remainder{0, kRemainder_ns};
  return ::ppoll(polled, count, &remainder, nullptr);
}
