#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "model/control.h"
#include "module/control_server.h"
#include "runtime/camera_worker.h"
#include "runtime/control_channel.h"

namespace mocap::runtime {

/// The control thread: works off what operators ask, one request after the other. It holds nobody up: orders go to the
/// other threads by queues, and an order that is not answered in time is told to be so.
class ControlWorker {
 public:
  /// All outlive the worker.
  struct Links {
    ControlChannel* control = nullptr;
    std::vector<CameraChannel*> cameras;  ///< by CameraId
  };

  /// `lossless`: a replay, which cannot be stopped and started.
  ControlWorker(std::unique_ptr<ControlServer> server, Description description, bool lossless, Links links);

  void run(const std::stop_token& stop);

 private:
  ControlAnswer work_off(const ControlRequest& request, const std::stop_token& stop);
  void take_news();
  ControlAnswer status() const;
  ControlAnswer next_snapshot(const std::stop_token& stop);
  ControlAnswer capture(bool on, const std::stop_token& stop);
  ControlAnswer order_subject(const ControlRequest& request, const std::stop_token& stop);
  ControlAnswer adjust_camera(const ControlRequest& request, const std::stop_token& stop);
  ControlAnswer learn_mask(const ControlRequest& request, const std::stop_token& stop);
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
  std::vector<bool> away_;  // by SubjectId
  std::uint64_t orders_ = 0;
};

}  // namespace mocap::runtime
