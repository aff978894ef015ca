// The part of CameraWorker that executes an operator's orders.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "base/log.h"
#include "runtime/camera/camera_worker.h"

namespace mocap::runtime {
namespace {

constexpr Duration kOrderPeriod = std::chrono::milliseconds(50);
constexpr int kStarts = 6;  // attempts of about 0.3 s while the search for the camera continues

OrderDone answer_to(const CameraOrder& order, const Status& end, std::string_view words) {
  OrderDone answer;
  answer.order = order.number;
  answer.done = end.has_value();
  answer.unsupported = !end && end.error().code == ErrorCode::Unsupported;
  const std::string_view text = end ? words : std::string_view(end.error().message);
  for (const char c : text.substr(0, answer.message.capacity())) answer.message.push_back(c);
  return answer;
}

// "exposure_us 500 -> 700, ": what the order changed from what to what.
std::string change_of(const std::optional<CameraAdjustment>& before, const CameraOrder& order) {
  std::string text;
  const auto add = [&](const char* name, const std::optional<double>& from, const std::optional<double>& to) {
    if (to) text += fmt::format("{} {} -> {}, ", name, from ? fmt::format("{:g}", *from) : "unknown", *to);
  };
  add("exposure_us", before ? before->exposure_us : std::nullopt, order.exposure_us);
  add("gain_db", before ? before->gain_db : std::nullopt, order.gain_db);
  return text;
}

}  // namespace

void CameraWorker::follow_orders() {
  while (const CameraOrder* order = channel_.orders.front()) {
    follow(*order);
    channel_.orders.pop();
  }
}

void CameraWorker::follow(const CameraOrder& order) {
  Status end;
  std::string words;
  switch (order.action) {
    case CameraAction::Start:
      stopped_ = false;
      words = "starting";
      break;
    case CameraAction::Stop:
      stopped_ = true;
      mask_order_.reset();  // the control thread has answered the request
      learner_.reset();
      words = "stopping";
      break;
    case CameraAction::Adjust: {
      const std::optional<CameraAdjustment> before = parts_.camera->adjustment();
      end = adjust(order);
      words = change_of(before, order) + "until the daemon is restarted";
      break;
    }
    case CameraAction::LearnMask:
      if (!parts_.camera->has_pixels()) {
        static_cast<void>(channel_.masks.try_push({.order = order.number, .polygons = {}, .has_pixels = false}));
        return;
      }
      mask_order_ = order;  // learn_mask() sends the answer
      learner_.reset();
      return;
  }
  static_cast<void>(channel_.orders_done.try_push(answer_to(order, end, words)));
}

// A camera applies new values when it starts, so a streaming camera is restarted and loses some images. If the restart
// fails, the old values are restored.
Status CameraWorker::adjust(const CameraOrder& order) {
  const std::optional<CameraAdjustment> before = parts_.camera->adjustment();
  if (!before) return parts_.camera->adjust({});
  CameraAdjustment wanted = *before;
  if (order.exposure_us) wanted.exposure_us = order.exposure_us;
  if (order.gain_db) wanted.gain_db = order.gain_db;
  learner_.reset();  // a mask is learnt from images of one exposure: it begins again
  if (Status set = parts_.camera->adjust(wanted); !set || stopped_ || !streaming_) return set;
  const auto restart = [&] {
    parts_.camera->stop();
    Status started = parts_.camera->start();
    for (int i = 0; i < kStarts && !started && started.error().code == ErrorCode::Timeout; ++i) {
      started = parts_.camera->start();
    }
    return started;
  };
  const Status started = restart();
  if (!started) {
    static_cast<void>(parts_.camera->adjust(*before));
    static_cast<void>(restart());  // if the restart fails, the loop detects the failure and reopens the camera
  }
  return started;
}

void CameraWorker::wait_until_started(const std::stop_token& stop) {
  note(CameraPhase::Stopped);
  log_info("camera " + parts_.name, "stopped");
  while (stopped_ && !stop.stop_requested()) {
    const WakeSignal::Ticket ticket = nap_.ticket();
    follow_orders();
    if (stop.stop_requested() || !stopped_) return;
    nap_.wait(ticket, kOrderPeriod);
  }
}

// Adds one image to the mask that an operator requested, and sends the mask after the last image.
void CameraWorker::learn_mask(const Image& image, double threshold_grey) {
  if (!learner_) learner_.emplace(image.width_px, image.height_px, parts_.drawn_masks);
  if (!learner_->add(image, threshold_grey) || learner_->images() < mask_order_->images) return;
  const detect::LearntMask learnt = learner_->learn({});
  static_cast<void>(
      channel_.masks.try_push({mask_order_->number, learnt.polygons, learnt.moved, learnt.covered_share}));
  learner_.reset();
  mask_order_.reset();
}

}  // namespace mocap::runtime
