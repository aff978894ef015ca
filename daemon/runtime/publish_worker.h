#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "model/description.h"
#include "model/health.h"
#include "module/publisher.h"
#include "runtime/camera_faults.h"
#include "runtime/counters.h"
#include "runtime/fusion_worker.h"
#include "runtime/latency.h"
#include "runtime/runtime_settings.h"

namespace mocap::runtime {

/// Who joins is answered between snapshots, too: a handshake with keys and a subscription take a turn each.
inline constexpr Duration kServeEvery = std::chrono::milliseconds(2);

/// The publish thread: snapshots to the wire, the description when it changes, the state of the service once a second.
class PublishWorker {
 public:
  /// All outlive the worker.
  struct Links {
    SnapshotChannel* snapshots = nullptr;
    std::vector<CameraChannel*> cameras;         ///< by CameraId
    std::vector<const StreamCounters*> streams;  ///< by CameraId
    const FusionCounters* fusion = nullptr;
    ControlChannel* control = nullptr;  ///< may be null
  };

  PublishWorker(std::unique_ptr<Publisher> publisher, Description description, PublishWorkerSettings settings,
                Links links, PublishCounters& counters);

  /// The loop; returns when the fusion has ended and all that it handed on is sent.
  void run();

 private:
  void learn_fits();
  bool send_what_waits();
  void send(Snapshot& snapshot);
  void tell_control(const Snapshot& snapshot);
  void report_when_due();
  void gather_health(Timestamp now);
  void gather_camera(std::size_t camera, double seconds);

  std::unique_ptr<Publisher> publisher_;
  Description description_;
  PublishWorkerSettings settings_;
  Links links_;
  PublishCounters& counters_;
  StageLatency latency_;
  Health health_;
  Timestamp reported_at_;
  std::uint64_t sets_reported_ = 0;
  std::vector<std::uint64_t> frames_reported_;  // by camera
  std::vector<CameraFaults> faults_;            // by camera
};

}  // namespace mocap::runtime
