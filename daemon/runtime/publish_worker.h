#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "model/description.h"
#include "model/health.h"
#include "module/audit_trail.h"
#include "module/publisher.h"
#include "runtime/camera/camera_faults.h"
#include "runtime/fusion_worker.h"
#include "runtime/pausable.h"
#include "runtime/preview_worker.h"
#include "runtime/report/counters.h"
#include "runtime/report/latency.h"
#include "runtime/report/recording_progress.h"
#include "runtime/runtime_settings.h"
#include "runtime/take_worker.h"

namespace mocap::runtime {

/// Period of Publisher::serve between snapshots. A client that joins with a key needs one call for the handshake and
/// one for its subscription.
inline constexpr Duration kServeEvery = std::chrono::milliseconds(2);

/// The publish thread: sends snapshots, the description when it changes, and the state of the daemon once a second.
class PublishWorker : public Pausable {
 public:
  /// All objects outlive the worker.
  struct Links {
    SnapshotChannel* snapshots = nullptr;
    std::vector<CameraChannel*> cameras;         ///< by CameraId
    std::vector<const StreamCounters*> streams;  ///< by CameraId
    const FusionCounters* fusion = nullptr;
    ControlChannel* control = nullptr;  ///< may be null
    std::vector<const RecordingProgress*> recordings = {};
    SearchChannel* search = nullptr;      ///< may be null: no reasons are published
    TakeChannel* takes = nullptr;         ///< may be null: no takes are recorded
    TimecodeChannel* timecode = nullptr;  ///< may be null: there is no source of timecode
    PreviewChannel* previews = nullptr;   ///< may be null: no previews are made
    const AuditTrail* audit = nullptr;    ///< may be null: there is no audit log
  };

  PublishWorker(std::unique_ptr<Publisher> publisher, Description description, PublishWorkerSettings settings,
                Links links, PublishCounters& counters);

  /// The loop; returns when the fusion thread has ended and all its snapshots are sent, or when it is paused and the
  /// waiting snapshots are sent. Begins with the description.
  void run();

  /// Continues with another description and other links. A camera of the same name and channel keeps its health.
  /// Call while no thread is in `run`.
  void change(Description description, PublishWorkerSettings settings, Links links);
  /// Closes the publisher. Until `set_publisher`, `run` must not be called. Call while no thread is in `run`.
  void close_publisher() noexcept { publisher_.reset(); }
  void set_publisher(std::unique_ptr<Publisher> publisher) noexcept { publisher_ = std::move(publisher); }

 private:
  void list_recordings();
  void apply_fits(std::uint32_t version);
  bool send_waiting();
  void send(Snapshot& snapshot);
  void update_control(const Snapshot& snapshot);
  void report_when_due();
  void send_preview();
  void ask_for_previews();
  void gather_health(Timestamp now);
  void gather_camera(std::size_t camera, double seconds);
  void gather_recordings();
  void gather_searches(Timestamp now);

  std::unique_ptr<Publisher> publisher_;
  Description description_;
  PublishWorkerSettings settings_;
  Links links_;
  PublishCounters& counters_;
  StageLatency latency_;
  Health health_;
  Timestamp reported_at_;
  Timestamp asked_for_previews_at_;
  std::uint64_t sets_reported_ = 0;
  std::vector<std::uint64_t> frames_reported_;  // by camera
  std::vector<CameraFaults> faults_;            // by camera
  /// The newest reason why a subject is not found.
  struct Search {
    SearchHealth health;
    std::optional<Timestamp> received_at;  // empty: none
    bool is_tracked = false;               // in the last snapshot
  };
  std::vector<Search> searches_;  // by subject
};

}  // namespace mocap::runtime
