#include "runtime/calibration_worker.h"

#include <fmt/format.h>

#include <utility>

#include "base/log.h"
#include "runtime/process/realtime.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

constexpr const char* kCalibration = "calibration";
// A tenth of the time in which a camera at 120 Hz fills its queue.
constexpr Duration kCollectPeriod = std::chrono::milliseconds(50);
constexpr Duration kReportPeriod = std::chrono::milliseconds(250);
// Below every other thread of the daemon and of other programs of default priority.
constexpr int kNiceness = 10;

CalibrationReport refused(const std::string& why) {
  CalibrationReport report;
  report.state = CalibrationState::Failed;
  report.message = why;
  return report;
}

}  // namespace

CalibrationWorker::CalibrationWorker(std::unique_ptr<RigCalibrator> calibrator, std::vector<CameraChannel*> cameras,
                                     CalibrationChannel& channel)
    : calibrator_(std::move(calibrator)), cameras_(std::move(cameras)), channel_(channel) {}

void CalibrationWorker::run(const std::stop_token& stop) {
  yield_to_other_threads(kNiceness);
  while (!stop.stop_requested()) {
    const WakeSignal::Ticket ticket = channel_.ordered.ticket();
    follow_orders();
    if (collecting_) {
      take_images();
      take_markers();
    }
    if (std::exchange(solves_, false)) solve(stop);
    if (report_waits_ && host_now() - reported_at_ >= kReportPeriod) send_report(report());
    channel_.ordered.wait(ticket, collecting_ || report_waits_ ? kCollectPeriod : kStopCheckPeriod);
  }
  end_collection();
  ended_.store(true, std::memory_order_release);
}

void CalibrationWorker::follow_orders() {
  CalibrationOrder order;
  while (channel_.orders.try_pop(order)) {
    order_ = order.number;
    follow(order);
    send_report(report());
  }
}

// An order to solve may come when the floor has been computed already.
void CalibrationWorker::follow(const CalibrationOrder& order) {
  switch (order.action) {
    case CalibrationAction::Wand:
    case CalibrationAction::Floor: return start(order);
    case CalibrationAction::Solve:
      if (!collecting_) return;
      take_images();
      return begin_solution();
    default: cancel();
  }
}

void CalibrationWorker::start(const CalibrationOrder& order) {
  end_collection();
  is_cancelled_ = false;
  refusal_.reset();
  if (const Status started = calibrator_->start(order); !started) {
    refusal_ = started.error().message;
    return;
  }
  collect(order.action);
}

void CalibrationWorker::begin_solution() {
  end_collection();
  channel_.cancelled.store(false, std::memory_order_relaxed);
  solving_.store(true, std::memory_order_release);
  solves_ = true;
}

void CalibrationWorker::cancel() {
  end_collection();
  solves_ = false;
  solving_.store(false, std::memory_order_release);
  is_cancelled_ = true;
  log_info(kCalibration, "cancelled");
}

void CalibrationWorker::count_dropped() {
  for (std::size_t i = 0; i < dropped_.size(); ++i) {
    dropped_[i] = cameras_[i]->counters.dropped_calibration_full.read() - dropped_before_[i];
  }
}

void CalibrationWorker::collect(CalibrationAction what) {
  collecting_ = true;
  if (what == CalibrationAction::Floor) {
    collect_markers(true);
    log_info(kCalibration, "the floor is measured");
    return;
  }
  collect_images(true);
  log_info(kCalibration, "images of the wand are collected");
}

void CalibrationWorker::end_collection() {
  if (!collecting_) return;
  collecting_ = false;
  count_dropped();
  collect_images(false);
  collect_markers(false);
}

void CalibrationWorker::collect_images(bool on) {
  for (CameraChannel* camera : cameras_) {
    camera->calibrating.store(false, std::memory_order_release);
    while (camera->to_calibrate.front() != nullptr) camera->to_calibrate.pop();
  }
  if (!on) return;
  dropped_before_.clear();
  dropped_.assign(cameras_.size(), 0);
  for (CameraChannel* camera : cameras_) {
    dropped_before_.push_back(camera->counters.dropped_calibration_full.read());
    camera->calibrating.store(true, std::memory_order_release);
  }
}

void CalibrationWorker::collect_markers(bool on) {
  MarkerChannel& channel = channel_.markers;
  channel.wanted.store(false, std::memory_order_release);
  while (channel.markers.front() != nullptr) channel.markers.pop();
  if (on) {
    dropped_.clear();  // a count of images
    channel.dropped.store(0, std::memory_order_relaxed);
    channel.wanted.store(true, std::memory_order_release);
    return;
  }
  const std::uint64_t dropped = channel.dropped.exchange(0, std::memory_order_relaxed);
  if (dropped > 0) log_warn(kCalibration, fmt::format("{} sets of markers were not examined", dropped));
}

void CalibrationWorker::take_images() {
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

// The floor is computed without a further order.
void CalibrationWorker::take_markers() {
  bool welcome = true;
  while (const CalibrationMarkers* markers = channel_.markers.markers.front()) {
    welcome = calibrator_->add(*markers) && welcome;
    channel_.markers.markers.pop();
    report_waits_ = true;
  }
  if (!welcome) begin_solution();
}

void CalibrationWorker::solve(const std::stop_token& stop) {
  log_info(kCalibration, "solving");
  std::string step_before;
  calibrator_->solve([&](const char* step, double fraction) {
    if (stop.stop_requested() || channel_.cancelled.load(std::memory_order_relaxed)) return false;
    if (step_before == step && host_now() - reported_at_ < kReportPeriod) return true;
    step_before = step;
    CalibrationReport now = report();
    now.state = CalibrationState::Solving;
    now.step = step;
    now.fraction = fraction;
    send_report(std::move(now));
    return true;
  });
  solving_.store(false, std::memory_order_release);
  const CalibrationReport end = report();
  log_info(kCalibration, end.result ? "solved" : "no result: " + end.message);
  send_report(end);
}

CalibrationReport CalibrationWorker::report() const {
  CalibrationReport report = calibrator_->report();
  if (refusal_) report = refused(*refusal_);
  report.order = order_;
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
