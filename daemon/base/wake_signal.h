#pragma once

#include <atomic>
#include <cstdint>

#include "base/time.h"

namespace mocap {

/// Wakes one sleeping thread from any number of others, without a lock (a Linux futex).
///
/// The waiter takes a ticket, checks for work, and sleeps only if nothing was signalled since the ticket:
/// no wake-up is lost. Signalling costs a system call only while the waiter sleeps.
class WakeSignal {
 public:
  using Ticket = std::uint32_t;

  /// Any thread. Async-signal-safe.
  void signal() noexcept;

  /// Waiter: call before checking for work.
  Ticket ticket() const noexcept { return count_.load(std::memory_order_acquire); }

  /// Waiter: sleeps until `signal` was called after `ticket`, or until `patience` has passed.
  void wait(Ticket ticket, Duration patience) noexcept;

 private:
  std::atomic<std::uint32_t> count_{0};
  std::atomic<std::uint32_t> sleepers_{0};
};

}  // namespace mocap
