#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "module/audit_trail.h"
#include "module/audit_writer.h"

namespace mocap::runtime {

/// The audit thread: writes entries that other threads note. A write that fails is tried again every second; until then
/// up to kMaxWaiting entries wait, and later ones are lost and counted. Lives as long as the process, so that a restart
/// of the pipeline is in the log too.
class AuditWorker final : public AuditTrail {
 public:
  static constexpr std::size_t kMaxWaiting = 1000;

  /// Starts the thread. Null: entries are discarded.
  explicit AuditWorker(std::unique_ptr<AuditWriter> writer);
  /// Writes the entries that wait, once.
  ~AuditWorker() override;

  void note(AuditEntry entry) override;
  bool write(AuditEntry entry, Duration patience) override;
  AuditHealth health() const override;

  /// Continues with another file, or with none. The entries that wait go into the next one. Does not wait for the disk.
  void change(std::unique_ptr<AuditWriter> writer);

 private:
  std::uint64_t push(AuditEntry entry);
  void run(const std::stop_token& stop);
  void take_next_writer();
  void write_waiting(std::unique_lock<std::mutex>& lock);
  void tell_lost();
  void note_result(const Status& result);

  mutable std::mutex mutex_;  // guards all below but the writer; held for moves of entries alone, never during a write
  std::condition_variable_any changed_;
  std::optional<std::unique_ptr<AuditWriter>> next_writer_;  // of change(), until the thread takes it
  bool on_;
  std::deque<AuditEntry> waiting_;
  std::size_t in_flight_ = 0;   // entries that are being written
  std::uint64_t pushed_ = 0;    // entries since the start, without the lost ones
  std::uint64_t written_ = 0;   // of these
  std::uint64_t attempts_ = 0;  // writes that failed
  std::uint64_t lost_ = 0;
  std::uint64_t lost_told_ = 0;  // in the log
  bool failing_ = false;
  BoundedVector<char, 255> error_;

  std::unique_ptr<AuditWriter> writer_;  // of the thread; null: off
  std::jthread thread_;
};

}  // namespace mocap::runtime
