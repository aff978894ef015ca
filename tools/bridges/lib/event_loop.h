#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>

#include "bridges/lib/descriptor.h"

namespace mocap::bridge {

/// Blocks SIGINT and SIGTERM in the calling thread and in those that it starts later, so that an EventLoop gets them.
/// For programs with a thread that starts before the loop is created.
void block_end_signals();

/// From now on SIGINT or SIGTERM ends the program again. For a program that still waits after its EventLoop.
void unblock_end_signals();

/// One thread that waits for many file descriptors (epoll) and for SIGINT and SIGTERM. Each method is called by that
/// thread.
class EventLoop {
 public:
  /// Called with the events of epoll (EPOLLIN, EPOLLOUT, EPOLLHUP, EPOLLERR).
  using Ready = std::function<void(std::uint32_t events)>;

  /// Blocks SIGINT and SIGTERM, so that run() returns instead: create the loop before any other thread, or see
  /// block_end_signals().
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Calls `ready` when `descriptor` has one of `events`. The caller owns the descriptor and calls forget() before it
  /// closes it. Both may be called inside a `ready`.
  void watch(int descriptor, std::uint32_t events, Ready ready);
  void change(int descriptor, std::uint32_t events);
  void forget(int descriptor);

  /// Calls `tick` every `period`, beginning at once, until stop(), SIGINT or SIGTERM.
  void run(std::chrono::milliseconds period, const std::function<void()>& tick);
  void stop() { running_ = false; }

 private:
  void dispatch(int timeout_ms);

  Descriptor epoll_;
  Descriptor signals_;
  std::unordered_map<int, std::shared_ptr<Ready>> ready_;
  bool running_ = true;
};

}  // namespace mocap::bridge
