// The part of ControlWorker that orders takes.
#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "runtime/control/control_answer.h"
#include "runtime/control/control_worker.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

// A take ends when the disk has all of it.
constexpr Duration kTakePatience = std::chrono::seconds(30);
constexpr Duration kTakePollPeriod = std::chrono::milliseconds(1);

ControlCode code_of(TakeOutcome outcome) {
  switch (outcome) {
    case TakeOutcome::Done: return ControlCode::Done;
    case TakeOutcome::Invalid: return ControlCode::Invalid;
    case TakeOutcome::NotFound: return ControlCode::NotFound;
    case TakeOutcome::Failed: break;
  }
  return ControlCode::Failed;
}

ControlAnswer answer_of(TakeDone taken) {
  ControlAnswer answer;
  answer.code = code_of(taken.outcome);
  answer.message = std::move(taken.message);
  answer.shots = std::move(taken.shots);
  return answer;
}

ControlAnswer recorder_is_late() {
  return plain_answer(ControlCode::Timeout, "the recorder did not answer in time; the request may still be executed");
}

}  // namespace

// Orders the recorder. Returns the answer if the request is refused; else answer_takes() answers it.
std::optional<ControlAnswer> ControlWorker::begin_take(const ControlRequest& request) {
  if (links_.takes == nullptr) {
    return plain_answer(ControlCode::Unsupported, "this run records no takes: its images come from recordings");
  }
  TakeOrder order = request.take;
  if (request.action == ControlAction::GetShots) order.action = TakeAction::ListShots;
  order.at = host_now();
  order.by = request.by;
  order.number = ++orders_;
  if (takes_.size() >= kMostTakeOrders || !links_.takes->orders.try_push(order)) {
    return plain_answer(ControlCode::Failed,
                        fmt::format("{} orders wait for the recorder, this one is not executed: the disk is slow; try "
                                    "again when they are answered",
                                    takes_.size()));
  }
  links_.takes->ordered.signal();
  takes_.push_back({request, order.number, order.at});
  return std::nullopt;
}

void ControlWorker::answer_takes() {
  TakeDone taken;
  while (!takes_.empty() && links_.takes->done.try_pop(taken)) {
    const auto found = std::ranges::find(takes_, taken.order, &OrderedTake::order);
    if (found != takes_.end()) answer_take(found, answer_of(std::move(taken)));
  }
  while (!takes_.empty() && host_now() - takes_.front().begun > kTakePatience) {
    answer_take(takes_.begin(), recorder_is_late());
  }
}

void ControlWorker::answer_take(std::vector<OrderedTake>::iterator take, const ControlAnswer& answer) {
  const OrderedTake answered = std::move(*take);
  takes_.erase(take);
  finish(answered.request, answer);
}

// Before a change of the configuration, which may replace the recorder.
void ControlWorker::await_takes(const std::stop_token& stop) {
  for (answer_takes(); !takes_.empty() && !stop.stop_requested(); answer_takes()) {
    std::this_thread::sleep_for(kTakePollPeriod);
  }
}

void ControlWorker::give_up_takes() {
  answer_takes();
  while (!takes_.empty()) answer_take(takes_.begin(), recorder_is_late());
}

Duration ControlWorker::request_patience() const { return takes_.empty() ? kStopCheckPeriod : kTakePollPeriod; }

}  // namespace mocap::runtime
