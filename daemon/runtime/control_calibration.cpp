// The part of ControlWorker that executes requests about the calibration.
#include <fmt/format.h>

#include <thread>
#include <utility>

#include "base/log.h"
#include "runtime/control_worker.h"

namespace mocap::runtime {
namespace {

constexpr Duration kCalibrationPatience = std::chrono::seconds(3);
constexpr Duration kCalibrationPoll = std::chrono::milliseconds(1);

ControlAnswer calibration_answer(ControlCode code, std::string message) {
  ControlAnswer answer;
  answer.code = code;
  answer.message = std::move(message);
  return answer;
}

ControlAnswer not_calibrated_here() {
  return calibration_answer(ControlCode::Unsupported,
                            "a replay is not calibrated: use mocap-calibrate with the recording");
}

}  // namespace

void ControlWorker::receive_calibration() {
  if (links_.calibration == nullptr) return;
  while (CalibrationReport* report = links_.calibration->reports.front()) {
    calibration_ = std::move(*report);
    links_.calibration->reports.pop();
  }
}

ControlAnswer ControlWorker::look_at_calibration(const CalibrationOrder& order, const std::stop_token& stop) {
  if (order.action == CalibrationAction::List) {
    MainOrder list;
    list.list_rigs = true;
    return order_main(std::move(list), stop);
  }
  ControlAnswer answer;
  answer.calibration = &calibration_;
  return answer;
}

ControlAnswer ControlWorker::calibrate(const CalibrationOrder& order, const std::stop_token& stop) {
  if (links_.calibration == nullptr) return not_calibrated_here();
  switch (order.action) {
    case CalibrationAction::Apply: return apply_calibration(stop);
    case CalibrationAction::Restore: {
      MainOrder restore;
      restore.restore = order.name;
      return order_main(std::move(restore), stop);
    }
    default: return order_calibration(order, stop);
  }
}

ControlAnswer ControlWorker::order_calibration(CalibrationOrder order, const std::stop_token& stop) {
  CalibrationChannel& channel = *links_.calibration;
  const bool cancels = order.action == CalibrationAction::Cancel;
  const bool solving = calibration_.state == CalibrationState::Solving;
  if (solving && !cancels) {
    return calibration_answer(ControlCode::Failed, "a rig is being computed; wait for its end, or cancel it");
  }
  if (cancels) channel.cancelled.store(true, std::memory_order_relaxed);
  const std::uint64_t number = order.number = ++orders_;
  if (!channel.orders.try_push(std::move(order))) {
    return calibration_answer(ControlCode::Timeout, "the calibration did not answer in time");
  }
  channel.ordered.signal();
  // A step of the solution may take longer than the patience of a client.
  if (solving) return calibration_answer(ControlCode::Done, "the calibration ends after the step in progress");
  const Timestamp begun = host_now();
  while (!stop.stop_requested() && host_now() - begun < kCalibrationPatience) {
    receive_calibration();
    CalibrationDone done;
    while (channel.done.try_pop(done)) {
      if (done.order != number) continue;
      receive_calibration();
      if (!done.end) return calibration_answer(ControlCode::Invalid, done.end.error().message);
      ControlAnswer answer;
      answer.calibration = &calibration_;
      return answer;
    }
    std::this_thread::sleep_for(kCalibrationPoll);
  }
  return calibration_answer(ControlCode::Timeout,
                            "the calibration did not answer in time; the request may still be executed");
}

ControlAnswer ControlWorker::apply_calibration(const std::stop_token& stop) {
  if (calibration_.state != CalibrationState::Solved || !calibration_.result) {
    return calibration_answer(ControlCode::Invalid,
                              "there is no rig to apply; calibrate first (mocapctl calibrate wand)");
  }
  MainOrder write;
  write.rig = calibration_.result->calibrated;
  ControlAnswer answer = order_main(std::move(write), stop);
  if (answer.code == ControlCode::Done) calibration_.state = CalibrationState::Applied;
  return answer;
}

}  // namespace mocap::runtime
