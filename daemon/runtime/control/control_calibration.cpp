// The part of ControlWorker that executes requests about the calibration.
#include <fmt/format.h>

#include <utility>

#include "base/log.h"
#include "runtime/control/control_answer.h"
#include "runtime/control/control_worker.h"

namespace mocap::runtime {
namespace {

ControlAnswer not_calibrated_here() {
  return plain_answer(ControlCode::Unsupported, "a replay is not calibrated: use mocap-calibrate with the recording");
}

}  // namespace

void ControlWorker::receive_calibration() {
  if (links_.calibration == nullptr) return;
  while (CalibrationReport* report = links_.calibration->reports.front()) {
    if (report->order == calibration_order_) calibration_ = std::move(*report);
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
    default: return order_calibration(order);
  }
}

// The calibration thread may take seconds until it follows the order: it loads the solver, or is in a step of a
// solution. So the answer says what was ordered, and reports from before the order are passed over.
ControlAnswer ControlWorker::order_calibration(CalibrationOrder order) {
  CalibrationChannel& channel = *links_.calibration;
  const bool cancels = order.action == CalibrationAction::Cancel;
  if (calibration_.state == CalibrationState::Solving && !cancels) {
    return plain_answer(ControlCode::Failed, "a rig is being computed; wait for its end, or cancel it");
  }
  if (order.action == CalibrationAction::Solve && calibration_.state != CalibrationState::Collecting) {
    return plain_answer(ControlCode::Invalid,
                        "nothing is collected; start with a wand (mocapctl calibrate wand) or with the floor "
                        "(mocapctl calibrate floor)");
  }
  if (cancels) channel.cancelled.store(true, std::memory_order_relaxed);
  order.number = calibration_order_ + 1;
  const CalibrationAction action = order.action;
  if (!channel.orders.try_push(std::move(order))) {
    return plain_answer(ControlCode::Timeout, "the calibration is busy; try again in a few seconds");
  }
  ++calibration_order_;
  channel.ordered.signal();
  expect_calibration(action);
  ControlAnswer answer;
  answer.calibration = &calibration_;
  return answer;
}

// The report until the calibration thread has followed the order.
void ControlWorker::expect_calibration(CalibrationAction ordered) {
  switch (ordered) {
    case CalibrationAction::Solve: calibration_.state = CalibrationState::Solving; return;
    case CalibrationAction::Cancel:
      calibration_.state = CalibrationState::Cancelled;
      calibration_.message = "cancelled by an operator";
      calibration_.result.reset();
      return;
    default:
      calibration_ = CalibrationReport{};
      calibration_.state = CalibrationState::Collecting;
      calibration_.is_floor = ordered == CalibrationAction::Floor;
      calibration_.advice = "starting";
  }
}

ControlAnswer ControlWorker::apply_calibration(const std::stop_token& stop) {
  if (calibration_.state != CalibrationState::Solved || !calibration_.result) {
    return plain_answer(ControlCode::Invalid, "there is no rig to apply; calibrate first (mocapctl calibrate wand)");
  }
  MainOrder write;
  write.rig = calibration_.result->calibrated;
  ControlAnswer answer = order_main(std::move(write), stop);
  if (answer.code == ControlCode::Done) calibration_.state = CalibrationState::Applied;
  return answer;
}

}  // namespace mocap::runtime
