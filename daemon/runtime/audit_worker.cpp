#include "runtime/audit_worker.h"

#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "base/log.h"
#include "model/search_health.h"
#include "runtime/process/realtime.h"

namespace mocap::runtime {
namespace {

constexpr const char* kAudit = "audit";
constexpr Duration kTryAgain = std::chrono::seconds(1);

}  // namespace

AuditWorker::AuditWorker(std::unique_ptr<AuditWriter> writer) : on_(writer != nullptr), writer_(std::move(writer)) {
  thread_ = std::jthread([this](const std::stop_token& stop) {
    name_this_thread("mocap-audit");
    run(stop);
  });
}

AuditWorker::~AuditWorker() {
  thread_.request_stop();
  changed_.notify_all();
}

// Returns the number of the entry; 0: it was not taken.
std::uint64_t AuditWorker::push(AuditEntry entry) {
  if (!on_) return 0;
  if (waiting_.size() + in_flight_ >= kMaxWaiting) {
    ++lost_;
    return 0;
  }
  waiting_.push_back(std::move(entry));
  return ++pushed_;
}

void AuditWorker::note(AuditEntry entry) {
  entry.at_utc_ns = to_ns(host_now()) + utc_minus_host().count();
  {
    const std::lock_guard lock(mutex_);
    push(std::move(entry));
  }
  changed_.notify_all();
}

bool AuditWorker::write(AuditEntry entry, Duration patience) {
  entry.at_utc_ns = to_ns(host_now()) + utc_minus_host().count();
  std::unique_lock lock(mutex_);
  const std::uint64_t attempts = attempts_;
  const std::uint64_t number = push(std::move(entry));
  if (number == 0) return false;
  changed_.notify_all();
  changed_.wait_for(lock, patience, [&] { return written_ >= number || attempts_ != attempts; });
  return written_ >= number;
}

AuditHealth AuditWorker::health() const {
  const std::lock_guard lock(mutex_);
  AuditHealth health;
  health.on = on_;
  health.lines = written_;
  health.waiting = waiting_.size() + in_flight_;
  health.lost = lost_;
  health.error = error_;
  return health;
}

void AuditWorker::change(std::unique_ptr<AuditWriter> writer) {
  {
    const std::lock_guard lock(mutex_);
    on_ = writer != nullptr;
    next_writer_ = std::move(writer);
  }
  changed_.notify_all();
}

void AuditWorker::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const std::uint64_t pushed = pushed_;
    changed_.wait_for(lock, stop, kTryAgain,
                      [&] { return next_writer_ || (failing_ ? pushed_ != pushed : !waiting_.empty()); });
    take_next_writer();
    // After a flush that failed, nothing may wait: it is tried again, too.
    if (writer_ && (failing_ || !waiting_.empty())) write_waiting(lock);
  }
  if (writer_ && !waiting_.empty()) write_waiting(lock);
}

void AuditWorker::take_next_writer() {
  if (!next_writer_) return;
  writer_ = *std::exchange(next_writer_, std::nullopt);
  failing_ = false;
  error_.clear();
  if (writer_) return;
  pushed_ -= waiting_.size();
  waiting_.clear();
}

// Writes without the lock. Entries that cannot be written go back to the front of the queue.
void AuditWorker::write_waiting(std::unique_lock<std::mutex>& lock) {
  tell_lost();
  std::deque<AuditEntry> batch = std::exchange(waiting_, {});
  in_flight_ = batch.size();
  lock.unlock();
  Status result;
  std::size_t done = 0;
  while (done < batch.size() && (result = writer_->append(batch[done]))) ++done;
  if (const Status synced = writer_->sync(); !synced && result) result = synced;
  note_result(result);
  lock.lock();
  in_flight_ = 0;
  waiting_.insert(waiting_.begin(), std::move_iterator(batch.begin() + static_cast<std::ptrdiff_t>(done)),
                  std::move_iterator(batch.end()));
  written_ += done;
  failing_ = !result;
  if (failing_) ++attempts_;
  error_ = bounded_text<255>(result ? std::string_view() : result.error().message);
  changed_.notify_all();
}

// An entry for those that were lost while the queue was full.
void AuditWorker::tell_lost() {
  if (lost_ == lost_told_ || waiting_.size() >= kMaxWaiting) return;
  AuditEntry entry{.what = "lost", .details = {{"lines", std::to_string(lost_ - lost_told_)}}};
  entry.at_utc_ns = waiting_.empty() ? 0 : waiting_.back().at_utc_ns;
  waiting_.push_back(std::move(entry));
  ++pushed_;
  lost_told_ = lost_;
}

// Logs the first failure of a row, and the end of the row. The audit thread alone reads failing_ here.
void AuditWorker::note_result(const Status& result) {
  if (!result && !failing_) {
    log_error(kAudit, result.error().message + "; entries wait in memory, at most " + std::to_string(kMaxWaiting));
  }
  if (result && failing_) log_info(kAudit, "is written again");
}

}  // namespace mocap::runtime
