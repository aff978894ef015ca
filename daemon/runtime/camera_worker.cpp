#include "runtime/camera_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/log.h"

namespace mocap::runtime {
namespace {

// How long the loop may sleep in a camera before it looks whether it is to stop.
constexpr Duration kLookAtStop = std::chrono::milliseconds(50);
constexpr Duration kTellAgain = std::chrono::minutes(1);

bool alike(const Image& a, const Image& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.format == b.format;
}

// A camera's messages begin with its name; so does the log's line.
std::string without_name(std::string message, const std::string& name) {
  const std::string own = "camera '" + name + "': ";
  if (message.rfind(own, 0) == 0) message.erase(0, own.size());
  return message;
}

}  // namespace

CameraWorker::CameraWorker(CameraParts parts, CameraWorkerSettings settings, CameraChannel& channel)
    : parts_(std::move(parts)), settings_(std::move(settings)), channel_(channel) {}

void CameraWorker::run(const std::stop_token& stop) {
  const std::string who = "camera " + parts_.name;
  const Status allowed = apply_to_this_thread(settings_.thread);
  if (!allowed) log_warn(who, allowed.error().message);
  // Ends a nap at once when the service stops.
  const std::stop_callback wake(stop, [this] {
    nap_.signal();
    channel_.room.signal();
  });

  Duration backoff = settings_.first_backoff;
  while (!stop.stop_requested()) {
    const Status end = stream(stop);
    parts_.camera->stop();
    deliver(Delivery::Ended);
    if (end && stopped_) {
      wait_until_started(stop);
      continue;
    }
    if (end) break;
    if (end.error().code == ErrorCode::EndOfStream) {
      log_info(who, fmt::format("ended after {} images", channel_.counters.frames.read()));
      note(CameraPhase::Ended);
      return;
    }
    if (streaming_) backoff = settings_.first_backoff;
    tell_failure(without_name(end.error().message, parts_.name));
    wait_before_retry(backoff, stop);
    if (stopped_) wait_until_started(stop);
    backoff = std::min(2 * backoff, settings_.longest_backoff);
    channel_.counters.reopened.add();
  }
  note(CameraPhase::Ended);
}

Status CameraWorker::stream(const std::stop_token& stop) {
  streaming_ = silent_ = false;
  // While a camera that failed is tried again, health goes on saying why.
  if (told_reason_.empty()) note(CameraPhase::Starting);
  const Status started = start_camera(stop);
  if (!started) return started;

  Timestamp heard_at = host_now();
  while (!stop.stop_requested()) {
    follow_orders();
    if (stopped_) return {};
    const Result<Frame> frame = parts_.camera->next(kLookAtStop);
    if (frame) {
      heard_at = host_now();
      const Status taken = take_in(*frame, stop);
      if (!taken) return taken;
    } else if (frame.error().code == ErrorCode::Timeout) {
      const Duration allowed = streaming_ ? settings_.silent_after : settings_.first_image_within;
      const Duration silence = host_now() - heard_at;
      if (silence > allowed && !settings_.lossless) {
        silent_ = true;
        return Error{ErrorCode::DeviceLost,
                     fmt::format("open, but no image for {:.0f} ms; is it triggered, is its link up, is its period "
                                 "shorter than that ([reopen] silent_after_ms)",
                                 1e3 * to_s(allowed))};
      }
    } else if (frame.error().code == ErrorCode::Io) {
      heard_at = host_now();
      channel_.counters.failed_frames.add();
    } else {
      return frame.error();
    }
  }
  return {};
}

// A camera that is still being looked for is asked again, as long as one that sends nothing is waited for.
Status CameraWorker::start_camera(const std::stop_token& stop) {
  const Timestamp begun_at = host_now();
  for (;;) {
    const Status started = parts_.camera->start();
    if (started || started.error().code != ErrorCode::Timeout) return started;
    if (stop.stop_requested()) return {};
    if (host_now() - begun_at > settings_.first_image_within) return started;
  }
}

Status CameraWorker::take_in(const Frame& frame, const std::stop_token& stop) {
  if (detector_ == nullptr || !alike(frame.image, detector_made_for_)) {
    const Status prepared = prepare_for(frame.image);
    if (!prepared) return prepared;
  }
  if (!streaming_) {
    streaming_ = true;
    told_reason_.clear();
    next_number_ = frame.number;
    log_info("camera " + parts_.name, fmt::format("streaming size={}x{}", frame.image.width_px, frame.image.height_px));
    note(CameraPhase::Streaming);
  }
  channel_.counters.frames.add();
  if (frame.number > next_number_) channel_.counters.missing_frames.add(frame.number - next_number_);
  next_number_ = frame.number + 1;

  const Detection detection = detector_->detect(frame.image);
  channel_.counters.detection.add(detection);
  if (mask_order_) learn_mask(frame.image, detection.threshold_grey);
  seen_.camera = frame.camera;
  seen_.number = frame.number;
  seen_.exposed_at = frame.exposed_at;
  seen_.received_at = frame.received_at;
  seen_.blobs = detection.blobs;
  parts_.tracker->track(seen_);
  seen_.detected_at = settings_.lossless ? frame.received_at : host_now();
  record(stop);
  push(stop);
  return {};
}

Status CameraWorker::prepare_for(const Image& image) {
  if (parts_.expected_width_px != 0 &&
      (image.width_px != parts_.expected_width_px || image.height_px != parts_.expected_height_px)) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("images are {}x{}, the rig was calibrated at {}x{}; set the camera's size or calibrate anew",
                    image.width_px, image.height_px, parts_.expected_width_px, parts_.expected_height_px)};
  }
  Result<std::unique_ptr<Detector>> made = parts_.make_detector(image);
  if (!made) return made.error();
  detector_ = std::move(*made);
  detector_made_for_ = image;
  detector_made_for_.bytes = {};
  return {};
}

void CameraWorker::push(const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = channel_.room.ticket();
    if (channel_.frames.try_push(seen_)) break;
    if (!settings_.lossless) {
      channel_.counters.dropped_queue_full.add();
      return;
    }
    if (stop.stop_requested()) return;
    channel_.room.wait(ticket, kLookAtStop);
  }
  deliver(Delivery::Delivering);
}

void CameraWorker::record(const std::stop_token& stop) {
  if (channel_.to_record == nullptr) return;
  for (;;) {
    const WakeSignal::Ticket ticket = channel_.record_room.ticket();
    if (channel_.to_record->try_push(seen_)) break;
    if (!settings_.lossless) {
      channel_.counters.dropped_record_full.add();
      return;
    }
    if (stop.stop_requested()) return;
    channel_.record_room.wait(ticket, kLookAtStop);
  }
  channel_.wake_recorder->signal();
}

void CameraWorker::tell_failure(const std::string& reason) {
  note(silent_ ? CameraPhase::Silent : CameraPhase::Reopening, reason);
  const Timestamp now = host_now();
  // A camera that is away for a day does not fill the journal: each reason once, and again once a minute.
  if (reason == told_reason_ && now - told_at_ < kTellAgain) return;
  told_reason_ = reason;
  told_at_ = now;
  log_error("camera " + parts_.name, fmt::format("{}; the others go on, trying again every {:.3g} s until it is back",
                                                 reason, to_s(settings_.longest_backoff)));
}

void CameraWorker::note(CameraPhase phase, const std::string& error) {
  CameraNote note;
  note.phase = phase;
  for (const char c : std::string_view(error).substr(0, note.error.capacity())) note.error.push_back(c);
  static_cast<void>(channel_.notes.try_push(note));
}

void CameraWorker::deliver(Delivery state) {
  channel_.delivery.store(state, std::memory_order_release);
  channel_.wake_fusion.signal();
}

void CameraWorker::wait_before_retry(Duration span, const std::stop_token& stop) {
  const Timestamp until = host_now() + span;
  for (Duration left = span; left > Duration::zero() && !stop.stop_requested(); left = until - host_now()) {
    const WakeSignal::Ticket ticket = nap_.ticket();
    follow_orders();
    if (stop.stop_requested() || stopped_) return;
    nap_.wait(ticket, std::min(left, kLookAtStop));
  }
}

}  // namespace mocap::runtime
