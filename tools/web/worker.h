#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace mocap::web {

/// Executes functions, one after the other, in a thread of its own, so that a slow disk never delays the server's loop.
class Worker {
 public:
  Worker();
  /// As stop().
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Queues a function. Returns false if 16 wait.
  bool run(std::function<void()> work);
  /// Functions that wait are not executed; the one that is executed ends first.
  void stop();
  /// Whether a function is executed: the destructor would wait for it.
  bool is_busy() const { return busy_; }

 private:
  void work_until(const std::stop_token& stop);

  std::atomic<bool> busy_ = false;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> waiting_;  // guarded by mutex_
  std::jthread thread_;                        // last: stops before the rest is destroyed
};

}  // namespace mocap::web
