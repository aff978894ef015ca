#pragma once

namespace mocap {

/// Wakes a thread that waits for file descriptors (poll, epoll) from any number of others: an eventfd.
class WakeDescriptor {
 public:
  WakeDescriptor();
  ~WakeDescriptor();
  WakeDescriptor(const WakeDescriptor&) = delete;
  WakeDescriptor& operator=(const WakeDescriptor&) = delete;

  /// Readable from `signal` until `clear`; -1 if the system has no descriptor left: then the waiter wakes at the end of
  /// its patience only.
  int number() const noexcept { return number_; }

  /// Any thread. Async-signal-safe.
  void signal() noexcept;
  /// Waiter: call before checking for work.
  void clear() noexcept;

 private:
  int number_;
};

}  // namespace mocap
