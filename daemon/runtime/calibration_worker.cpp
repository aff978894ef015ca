#include "runtime/calibration_worker.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

#include "base/log.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

constexpr const char* kCalibration = "calibration";
// A tenth of the time in which a camera at 120 Hz fills its queue.
constexpr Duration kCollectPeriod = std::chrono::milliseconds(50);
constexpr Duration kReportPeriod = std::chrono::milliseconds(250);
// Below every other thread of the daemon and of other programs of default priority.
constexpr int kNiceness = 10;

}  // namespace

CalibrationWorker::CalibrationWorker(std::unique_ptr<RigCalibrator> calibrator, std::vector<CameraChannel*> cameras,
                                     CalibrationChannel& channel)
    : calibrator_(std::move(calibrator)), cameras_(std::move(cameras)), channel_(channel) {}

void CalibrationWorker::run(const std::stop_token& stop) {
  // The threads of the solver inherit it. A lower priority needs no privilege.
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness));
  while (!stop.stop_requested()) {
    const WakeSignal::Ticket ticket = channel_.ordered.ticket();
    follow_orders(stop);
    take_images();
    if (report_waits_ && host_now() - reported_at_ >= kReportPeriod) send_report(report());
    channel_.ordered.wait(ticket, collecting_ || report_waits_ ? kCollectPeriod : kStopCheckPeriod);
  }
  if (collecting_) collect(false);
  ended_.store(true, std::memory_order_release);
}

void CalibrationWorker::follow_orders(const std::stop_token& stop) {
  CalibrationOrder order;
  while (channel_.orders.try_pop(order)) {
    const Status end = follow(order);
    send_report(report());  // before the answer, so that a client which asks next finds it
    static_cast<void>(channel_.done.try_push({order.number, end}));
    if (std::exchange(solves_, false)) solve(stop);
  }
}

Status CalibrationWorker::follow(const CalibrationOrder& order) {
  switch (order.action) {
    case CalibrationAction::Wand: {
      const Status started = calibrator_->start(order);
      is_cancelled_ = false;
      collect(started.has_value());
      if (started) log_info(kCalibration, "images of the wand are collected");
      return started;
    }
    case CalibrationAction::Solve:
      if (!collecting_) {
        return Error{ErrorCode::InvalidArgument,
                     "no images are collected; start with a wand (mocapctl calibrate wand)"};
      }
      take_images();
      collect(false);
      channel_.cancelled.store(false, std::memory_order_relaxed);
      solving_.store(true, std::memory_order_release);
      solves_ = true;
      return {};
    default: cancel(); return {};
  }
}

void CalibrationWorker::cancel() {
  collect(false);
  is_cancelled_ = true;
  log_info(kCalibration, "cancelled");
}

void CalibrationWorker::count_dropped() {
  for (std::size_t i = 0; i < dropped_.size(); ++i) {
    dropped_[i] = cameras_[i]->counters.dropped_calibration_full.read() - dropped_before_[i];
  }
}

void CalibrationWorker::collect(bool on) {
  if (collecting_) count_dropped();
  for (CameraChannel* camera : cameras_) {
    camera->calibrating.store(false, std::memory_order_release);
    while (camera->to_calibrate.front() != nullptr) camera->to_calibrate.pop();
  }
  collecting_ = on;
  if (!on) return;
  dropped_before_.clear();
  dropped_.assign(cameras_.size(), 0);
  for (CameraChannel* camera : cameras_) {
    dropped_before_.push_back(camera->counters.dropped_calibration_full.read());
    camera->calibrating.store(true, std::memory_order_release);
  }
}

void CalibrationWorker::take_images() {
  if (!collecting_) return;
  count_dropped();
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    bool welcome = true;
    while (const CalibrationImage* image = cameras_[i]->to_calibrate.front()) {
      welcome = calibrator_->add(i, *image) && welcome;
      cameras_[i]->to_calibrate.pop();
      report_waits_ = true;
    }
    // The others go on: a camera with a lower rate needs longer.
    if (!welcome) cameras_[i]->calibrating.store(false, std::memory_order_release);
  }
}

void CalibrationWorker::solve(const std::stop_token& stop) {
  log_info(kCalibration, "solving");
  std::string step_before;
  calibrator_->solve([&](const char* step, double fraction) {
    if (stop.stop_requested() || channel_.cancelled.load(std::memory_order_relaxed)) return false;
    if (step_before == step && host_now() - reported_at_ < kReportPeriod) return true;
    step_before = step;
    CalibrationReport now = report();
    now.step = step;
    now.fraction = fraction;
    send_report(std::move(now));
    return true;
  });
  solving_.store(false, std::memory_order_release);
  const CalibrationReport end = report();
  log_info(kCalibration, end.result ? "solved: " + end.result->grade : "no rig: " + end.message);
  send_report(end);
}

CalibrationReport CalibrationWorker::report() const {
  CalibrationReport report = calibrator_->report();
  if (is_cancelled_) {
    report.state = CalibrationState::Cancelled;
    report.message = "cancelled by an operator";
    report.result.reset();
  }
  if (solves_) report.state = CalibrationState::Solving;
  for (std::size_t i = 0; i < report.cameras.size() && i < dropped_.size(); ++i) {
    report.cameras[i].dropped = dropped_[i];
  }
  return report;
}

void CalibrationWorker::send_report(CalibrationReport report) {
  reported_at_ = host_now();
  report_waits_ = !channel_.reports.try_push(std::move(report));
}

}  // namespace mocap::runtime
