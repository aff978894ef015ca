#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "model/calibration/calibration_order.h"
#include "model/calibration/calibration_report.h"
#include "module/rig_calibrator.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/marker_channel.h"

namespace mocap::runtime {

/// Queues between the calibration thread and the control thread.
struct CalibrationChannel {
  SpscQueue<CalibrationOrder> orders{4};    ///< Wand, Floor, Solve and Cancel; the control thread then signals ordered
  SpscQueue<CalibrationReport> reports{4};  ///< when they change, a few times a second
  std::atomic<bool> cancelled{false};       ///< set by the control thread with Cancel: ends a solution
  WakeSignal ordered;
  MarkerChannel markers;
};

/// The calibration thread: while an operator asks for it, collects images of a waved wand from the camera threads and
/// computes the rig, or collects markers from the fusion thread and measures the floor. It runs at low priority and
/// nobody waits for it: if it is too slow, images are missing in the collection (counted), never in the pipeline.
class CalibrationWorker {
 public:
  /// The channels outlive the worker.
  CalibrationWorker(std::unique_ptr<RigCalibrator> calibrator, std::vector<CameraChannel*> cameras,
                    CalibrationChannel& channel);

  /// The loop; returns when stopped. A collection or a solution in progress ends then without a result. A step of a
  /// solution may last for seconds, in which the worker does not use the cameras' channels: they may be gone.
  void run(const std::stop_token& stop);

  bool is_solving() const noexcept { return solving_.load(std::memory_order_acquire); }
  /// Whether the loop has returned.
  bool has_ended() const noexcept { return ended_.load(std::memory_order_acquire); }

 private:
  void follow_orders();
  void follow(const CalibrationOrder& order);
  void start(const CalibrationOrder& order);
  void collect(CalibrationAction what);
  void collect_images(bool on);
  void collect_markers(bool on);
  void end_collection();
  void count_dropped();
  void take_images();
  void take_markers();
  void solve(const std::stop_token& stop);
  void begin_solution();
  void cancel();
  CalibrationReport report() const;
  void send_report(CalibrationReport report);

  std::unique_ptr<RigCalibrator> calibrator_;
  std::vector<CameraChannel*> cameras_;
  CalibrationChannel& channel_;
  std::vector<std::uint64_t> dropped_before_;  // by camera: counts at the start of the collection
  std::vector<std::uint64_t> dropped_;         // by camera: in the collection
  std::atomic<bool> solving_{false};
  std::atomic<bool> ended_{false};
  bool collecting_ = false;  // images or markers
  bool solves_ = false;
  bool is_cancelled_ = false;
  std::optional<std::string> refusal_;  // of the newest order to collect
  std::uint64_t order_ = 0;             // the newest that was followed
  bool report_waits_ = false;           // for room in the queue, or until it is due
  Timestamp reported_at_;
};

}  // namespace mocap::runtime
