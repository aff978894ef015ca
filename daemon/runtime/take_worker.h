#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/spsc_queue.h"
#include "base/wake_descriptor.h"
#include "base/wake_signal.h"
#include "model/take/belief.h"
#include "model/take/take_news.h"
#include "module/audit_trail.h"
#include "module/take_recorder.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/fusion_worker.h"
#include "runtime/report/counters.h"

namespace mocap::runtime {

/// Queues between the recorder of takes and the other threads, besides those of images and snapshots.
struct TakeChannel {
  SpscQueue<TakeOrder> orders{16};         ///< from the control thread, which then signals ordered
  WakeSignal ordered;                      ///< wakes the disk thread
  SpscQueue<TakeDone> done{32};            ///< to the control thread
  SpscQueue<Health> health{4};             ///< from the publish thread, with each report
  SpscQueue<TakeHealth> states{8};         ///< to the publish thread, several times a second and at each change
  SpscQueue<TakeOrder> trigger_orders{8};  ///< from the trigger thread, which then signals ordered
  SpscQueue<TakeNews> news{32};            ///< to the trigger thread, if news_wanted
  WakeDescriptor news_came;                ///< wakes the trigger thread
  std::atomic<bool> news_wanted{false};    ///< a trigger thread runs
};

/// The two threads of the recorder of takes. Intake empties the queues of images and snapshots and never waits for the
/// disk; the disk thread follows orders and writes. If the disk is too slow, images are missing in the take, never in
/// the feed.
class TakeWorker {
 public:
  /// What the worker shares with other threads.
  struct Links {
    SpscQueue<Belief>& beliefs;
    TakeChannel& channel;
    TimecodeChannel& timecode;
    const Counter& dropped_sets;  ///< sets that the fusion thread dropped at the full queue
    WakeSignal& wake;             ///< signalled by the camera threads
    AuditTrail* audit = nullptr;  ///< notes takes and the orders of triggers; may be null
  };

  /// All objects outlive the worker.
  TakeWorker(std::unique_ptr<TakeRecorder> recorder, const std::vector<CameraChannel*>& cameras,
             SnapshotChannel& snapshots, const Links& links);

  /// The loop of the intake thread; returns when stopped and the queues are empty.
  void run_intake(const std::stop_token& stop);
  /// The loop of the disk thread; returns when stopped. A take in progress goes on with the next call.
  void run_disk(const std::stop_token& stop);

  /// Continues with another configuration. Call while the intake thread does not run.
  void change(const Description& description, std::vector<TakeFile> files, const std::vector<CameraChannel*>& cameras,
              SnapshotChannel& snapshots);
  /// Ends a take in progress. `why`: the reason; empty: the daemon ends. Call while no thread runs; the last call.
  void finish(const std::string& why = {});
  /// Tells the trigger thread of another take, or another state of the take. Disk thread, or while it does not run.
  void tell_changes();

 private:
  // A counter of the pipeline, and its value when it was last looked at.
  struct Watched {
    const Counter* counter;
    std::uint64_t seen;

    std::uint64_t rise() {
      const std::uint64_t now = counter->read();
      return now - std::exchange(seen, now);
    }
  };
  struct Source {
    CameraChannel* camera;
    Watched dropped;
  };

  bool take_in();
  void report(Timestamp now);
  void follow_orders();
  void follow(TakeOrder order, bool of_trigger);
  bool pass_answers(std::uint64_t awaited = 0);
  void tell(TakeNews news);
  void remember_actor(const TakeOrder& order);
  void note_takes();

  std::unique_ptr<TakeRecorder> recorder_;
  std::vector<Source> cameras_;
  SnapshotChannel* snapshots_;
  Watched dropped_sets_;
  SpscQueue<Belief>& beliefs_;
  TakeChannel& channel_;
  TimecodeChannel& timecode_;
  WakeSignal& wake_;
  Timestamp reported_at_;
  TakeState reported_ = TakeState::None;
  struct Told {
    TakeState state = TakeState::None;
    std::uint64_t takes = 0;
  };
  std::optional<Told> told_;  // to the trigger thread
  AuditTrail* audit_;
  AuditActor starter_, ender_;  // of the last orders to begin and to end a take, until the log has them
  TakeHealth noted_;
};

}  // namespace mocap::runtime
