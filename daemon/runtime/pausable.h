#pragma once

#include <atomic>

namespace mocap::runtime {

/// A worker whose loop can end without ending its work. Call pause(), then request the stop of the thread and join it:
/// the loop processes the waiting data and returns, while device, file and queues stay open. The main thread may then
/// change the worker. After resume(), a new thread calls the loop again.
class Pausable {
 public:
  void pause() noexcept { pausing_.store(true, std::memory_order_release); }
  void resume() noexcept { pausing_.store(false, std::memory_order_release); }
  bool pausing() const noexcept { return pausing_.load(std::memory_order_acquire); }

 private:
  std::atomic<bool> pausing_{false};
};

}  // namespace mocap::runtime
