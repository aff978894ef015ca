#include "web/control_worker.h"

#include <utility>

namespace mocap::web {
namespace {

constexpr std::size_t kMaxWaiting = 16;

}  // namespace

Result<std::unique_ptr<ControlWorker>> ControlWorker::open(const wire::ControlClient::Settings& settings,
                                                           Duration patience) {
  auto client = wire::ControlClient::open(settings);
  if (!client) return client.error();
  return std::unique_ptr<ControlWorker>(new ControlWorker(*std::move(client), patience));
}

ControlWorker::ControlWorker(std::unique_ptr<wire::ControlClient> client, Duration patience)
    : client_(std::move(client)), patience_(patience), thread_([this](const std::stop_token& stop) { run(stop); }) {}

ControlWorker::~ControlWorker() = default;

bool ControlWorker::ask(std::string request, Done done) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kMaxWaiting) return false;
  waiting_.push_back({std::move(request), std::move(done)});
  changed_.notify_one();
  return true;
}

void ControlWorker::run(const std::stop_token& stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
    if (stop.stop_requested()) return;
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    busy_ = true;
    next.done(client_->ask(next.request, patience_));
    busy_ = false;
  }
}

}  // namespace mocap::web
