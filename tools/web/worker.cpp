#include "web/worker.h"

#include <utility>

namespace mocap::web {
namespace {

constexpr std::size_t kMaxWorkWaiting = 16;

}  // namespace

Worker::Worker() : thread_([this](const std::stop_token& stop) { work_until(stop); }) {}

Worker::~Worker() = default;

void Worker::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

bool Worker::run(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kMaxWorkWaiting) return false;
  waiting_.push_back(std::move(work));
  changed_.notify_one();
  return true;
}

void Worker::work_until(const std::stop_token& stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
    if (stop.stop_requested()) return;
    const std::function<void()> next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    busy_ = true;
    next();
    busy_ = false;
  }
}

}  // namespace mocap::web
