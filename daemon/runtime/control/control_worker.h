#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/control.h"
#include "module/audit_trail.h"
#include "module/control_server.h"
#include "runtime/calibration_worker.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/control/control_channel.h"
#include "runtime/take_worker.h"

namespace mocap::runtime {

/// The control thread: executes the requests of operators one after the other, and others while masks are learnt or a
/// take ends; only a change of the configuration waits for the end of a take. It never blocks another thread: orders go
/// to the other threads by queues. A request whose order is not answered in time is answered with Timeout.
class ControlWorker {
 public:
  /// All objects outlive the worker.
  struct Links {
    ControlChannel* control = nullptr;
    std::vector<CameraChannel*> cameras;        ///< by CameraId
    TakeChannel* takes = nullptr;               ///< may be null: no takes are recorded
    CalibrationChannel* calibration = nullptr;  ///< may be null: nothing is calibrated
    AuditTrail* audit = nullptr;                ///< may be null: orders are not noted
  };

  /// `lossless`: the run is a replay, which cannot be stopped and started.
  ControlWorker(std::unique_ptr<ControlServer> server, Description description, bool lossless, Links links);

  /// Executes requests until `stop`, or until the main thread is about to change the pipeline.
  void run(const std::stop_token& stop);

  /// Continues with another description and other cameras. A subject of the same name that was removed stays away. Call
  /// while no thread is in `run`.
  void change(Description description, Links links);
  /// Closes the socket. Until `set_server`, `run` must not be called. Call while no thread is in `run`.
  void close_server() noexcept { server_.reset(); }
  void set_server(std::unique_ptr<ControlServer> server) noexcept { server_ = std::move(server); }
  /// Whether the operators have not stopped the capture. Call while no thread is in `run`.
  bool capturing() const noexcept { return capturing_; }

 private:
  /// A request to learn masks, until each of its cameras has sent its mask.
  struct MaskLearning {
    ControlRequest request;
    std::uint64_t order = 0;                      ///< number of the order to the cameras
    std::vector<std::size_t> cameras;             ///< whose masks are missing, by CameraId
    std::vector<std::vector<MaskPolygon>> masks;  ///< by CameraId: the learnt masks of all cameras
    std::string text;                             ///< for the operator: a line for each camera that has sent its mask
    Timestamp begun{};
  };

  /// A request that the recorder has not answered yet.
  struct OrderedTake {
    ControlRequest request;
    std::uint64_t order = 0;
    Timestamp begun{};
  };
  static constexpr std::size_t kMostTakeOrders = 16;  // the queues of orders and of answers hold as many

  std::optional<ControlAnswer> begin(const ControlRequest& request, const std::stop_token& stop);
  ControlAnswer execute(const ControlRequest& request, const std::stop_token& stop);
  void finish(const ControlRequest& request, const ControlAnswer& answer);
  void note_order(const ControlRequest& request, const ControlAnswer& answer);
  void receive_updates();
  ControlAnswer status() const;
  ControlAnswer next_snapshot(const std::stop_token& stop);
  ControlAnswer capture(bool on, const std::stop_token& stop);
  ControlAnswer order_subject(const ControlRequest& request, const std::stop_token& stop);
  ControlAnswer adjust_camera(const ControlRequest& request, const std::stop_token& stop);
  std::optional<ControlAnswer> begin_to_learn(const ControlRequest& request);
  void continue_to_learn(const std::stop_token& stop);
  void stop_to_learn(std::string_view why);
  std::optional<ControlAnswer> receive_masks(MaskLearning& learning) const;
  ControlAnswer list_masks(const ControlRequest& request) const;
  ControlAnswer change_masks(const ControlRequest& request, const std::stop_token& stop);
  ControlAnswer draw_masks(std::size_t camera, const std::vector<MaskPolygon>& polygons, const std::stop_token& stop);
  ControlAnswer undo_masks(std::size_t camera, const std::stop_token& stop);
  ControlAnswer save_drawn(std::size_t camera, const std::vector<MaskPolygon>& polygons, const std::stop_token& stop);
  ControlAnswer forget_masks(std::size_t camera, const std::stop_token& stop);
  std::vector<std::vector<MaskPolygon>> learnt_masks() const;
  std::optional<ControlAnswer> begin_take(const ControlRequest& request);
  void answer_takes();
  void answer_take(std::vector<OrderedTake>::iterator take, const ControlAnswer& answer);
  void await_takes(const std::stop_token& stop);
  void give_up_takes();
  Duration request_patience() const;
  ControlAnswer look_at_calibration(const CalibrationOrder& order, const std::stop_token& stop);
  ControlAnswer calibrate(const CalibrationOrder& order, const std::stop_token& stop);
  ControlAnswer order_calibration(CalibrationOrder order);
  void expect_calibration(CalibrationAction ordered);
  ControlAnswer apply_calibration(const std::stop_token& stop);
  void receive_calibration();
  ControlAnswer order_main(MainOrder order, const std::stop_token& stop);
  std::optional<std::size_t> find_camera(const std::string& name) const;
  std::optional<OrderDone> wait_for(SpscQueue<OrderDone>& answers, std::uint64_t order, Duration patience,
                                    const std::stop_token& stop);
  ControlAnswer order_camera(std::size_t camera, CameraOrder order, const std::stop_token& stop);

  std::unique_ptr<ControlServer> server_;
  Description description_;
  bool lossless_;
  Links links_;
  std::optional<Health> health_;
  std::unique_ptr<Snapshot> snapshot_;
  bool capturing_ = true;
  // Until a snapshot comes, a request before is not worth waiting for: other requests wait behind it.
  Timestamp no_snapshot_until_;
  std::vector<bool> away_;  // by SubjectId: removed by an operator
  std::uint64_t orders_ = 0;
  bool change_follows_ = false;
  AuditActor asker_;                      // of the request that is executed
  std::optional<MaskLearning> learning_;  // the request that waits for masks
  std::vector<OrderedTake> takes_;        // the oldest first
  /// By camera: its drawn masks before each change, the newest last.
  std::map<std::string, std::deque<std::vector<MaskPolygon>>, std::less<>> drawn_before_;
  std::uint64_t calibration_order_ = 0;  // number of the newest order to the calibration
  CalibrationReport calibration_;        // the newest
};

}  // namespace mocap::runtime
