#include "runtime/camera/camera_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "base/log.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

// Longest wait before the loop checks for a stop request.
constexpr Duration kRepeatAfter = std::chrono::minutes(1);
constexpr Duration kBrightestPeriod = std::chrono::milliseconds(500);
// Begins the text of a failure at the start, which is another one than the same failure later.
constexpr const char* kWaitsFor = "waits: ";

bool alike(const Image& a, const Image& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.format == b.format;
}

// Texts of one kind of fault differ in numbers alone: that of the image, or its size.
std::string without_digits(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

// Removes the camera's name from the start of an error message: the log line already has the name.
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
  // A stop request ends every wait at once.
  const std::stop_callback wake(stop, [this] {
    nap_.signal();
    channel_.room.signal();
  });

  Duration backoff = settings_.first_backoff;
  while (!stop.stop_requested()) {
    if (stopped_) {
      wait_until_started(stop);
      continue;
    }
    const Status end = stream(stop);
    if (end && pausing()) return;
    parts_.camera->stop();
    started_ = false;
    deliver(Delivery::Ended);
    if (end && stopped_) continue;
    if (end) break;
    if (end.error().code == ErrorCode::EndOfStream) {
      log_info(who, fmt::format("ended after {} images", channel_.counters.frames.read()));
      note(CameraPhase::Ended);
      return;
    }
    if (streaming_) backoff = settings_.first_backoff;
    log_failure(end.error());
    wait_before_retry(backoff, stop);
    backoff = std::min(2 * backoff, settings_.longest_backoff);
    channel_.counters.reopened.add();
  }
  if (!pausing()) note(CameraPhase::Ended);
}

void CameraWorker::change(CameraParts parts, CameraWorkerSettings settings) {
  parts.camera = std::move(parts_.camera);
  parts.stream = std::move(parts_.stream);
  if (parts.tracker == nullptr) parts.tracker = std::move(parts_.tracker);
  parts_ = std::move(parts);
  settings_ = std::move(settings);
  detector_.reset();
  learner_.reset();
}

Status CameraWorker::stream(const std::stop_token& stop) {
  if (!started_) {
    streaming_ = silent_ = false;
    // During the retries after a failure, health keeps the reason of the failure.
    if (logged_reason_.empty()) {
      starting_at_ = host_now();
      note(CameraPhase::Starting);
    }
    const Status started = start_camera(stop);
    if (!started) return started;
    if (silence_is_held_) log_silence();
  }

  Timestamp heard_at = host_now();
  std::optional<Timestamp> unusable_since;  // first unusable image after the last usable one
  while (!stop.stop_requested()) {
    follow_orders();
    if (stopped_) return {};
    const Result<Frame> frame = parts_.camera->next(kStopCheckPeriod);
    if (frame) {
      heard_at = host_now();
      unusable_since.reset();
      const Status taken = process(*frame, stop);
      if (!taken) return taken;
    } else if (frame.error().code == ErrorCode::Timeout) {
      const Duration allowed = streaming_ ? settings_.silent_after : settings_.first_image_within;
      const Duration silence = host_now() - heard_at;
      if (silence > allowed && !parts_.recorded) {
        silent_ = true;
        return Error{
            ErrorCode::DeviceLost,
            fmt::format("open, but no image for {:.0f} ms; check its trigger and its link, and that its period "
                        "is shorter than this time ([reopen] silent_after_ms)",
                        1e3 * to_s(allowed))};
      }
    } else if (frame.error().code == ErrorCode::Io) {
      heard_at = host_now();
      if (!unusable_since) unusable_since = heard_at;
      const Status kept = note_unusable(frame.error(), heard_at, *unusable_since);
      if (!kept) return kept;
    } else {
      return frame.error();
    }
  }
  return {};
}

// Counts an image that cannot be used, and logs each kind of fault once a minute. A camera that has given only unusable
// images for long is lost for the reason of the last one.
Status CameraWorker::note_unusable(const Error& error, Timestamp now, Timestamp unusable_since) {
  channel_.counters.failed_frames.add();
  const std::string reason = without_name(error.message, parts_.name);
  if (unusable_.is_news(without_digits(reason), now)) {
    log_warn(
        "camera " + parts_.name,
        fmt::format("unusable image: {}; further ones like it are counted (failed_frames) and logged once a minute",
                    reason));
  }
  if (parts_.recorded || now - unusable_since <= settings_.first_image_within) return {};
  return Error{ErrorCode::DeviceLost,
               fmt::format("no usable image for {:.3g} s: {}", to_s(settings_.first_image_within), reason)};
}

// Starts the camera. While the search for the device continues (Timeout), repeats start() for at most
// first_image_within.
Status CameraWorker::start_camera(const std::stop_token& stop) {
  const Timestamp begun_at = host_now();
  for (;;) {
    const Status started = parts_.camera->start();
    started_ = started.has_value();
    if (started || started.error().code != ErrorCode::Timeout) return started;
    if (stop.stop_requested()) return {};
    if (host_now() - begun_at > settings_.first_image_within) return started;
  }
}

Status CameraWorker::process(const Frame& frame, const std::stop_token& stop) {
  if (detector_ == nullptr || !alike(frame.image, detector_made_for_)) {
    const Status prepared = prepare_for(frame.image);
    if (!prepared) return prepared;
  }
  if (!streaming_) {
    streaming_ = true;
    end_failure();
    next_number_ = frame.number;
    log_info("camera " + parts_.name, fmt::format("streaming size={}x{}", frame.image.width_px, frame.image.height_px));
    note(CameraPhase::Streaming);
  }
  channel_.counters.frames.add();
  if (frame.number > next_number_) channel_.counters.missing_frames.add(frame.number - next_number_);
  next_number_ = frame.number + 1;

  const Detection detection = detector_->detect(frame.image);
  channel_.counters.detection.add(detection);
  measure_brightest(frame, detection.blobs.empty());
  if (mask_order_) learn_mask(frame.image, detection.threshold_grey);
  seen_.camera = frame.camera;
  seen_.number = frame.number;
  seen_.exposed_at = frame.exposed_at;
  seen_.received_at = frame.received_at;
  seen_.blobs = detection.blobs;
  parts_.tracker->track(seen_);
  seen_.detected_at = settings_.lossless ? frame.received_at : host_now();
  record(stop);
  keep_for_take();
  pass_to_node(stop);
  push(stop);
  offer_preview(frame);
  offer_calibration(frame.image);
  return {};
}

// Measures the brightest pixel of an image without blobs, twice a second: an operator compares it with the threshold.
void CameraWorker::measure_brightest(const Frame& frame, bool is_blind) {
  if (!is_blind) {
    channel_.counters.detection.brightest_grey.set(0.0);
    return;
  }
  if (brightest_at_ && frame.received_at - *brightest_at_ < kBrightestPeriod) return;
  brightest_at_ = frame.received_at;
  channel_.counters.detection.brightest_grey.set(detector_->brightest_grey(frame.image));
}

Status CameraWorker::prepare_for(const Image& image) {
  if (parts_.expected_width_px != 0 &&
      (image.width_px != parts_.expected_width_px || image.height_px != parts_.expected_height_px)) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("images are {}x{}, the rig was calibrated at {}x{}; set the camera's size or calibrate again",
                    image.width_px, image.height_px, parts_.expected_width_px, parts_.expected_height_px)};
  }
  Result<std::unique_ptr<Detector>> made = parts_.make_detector(image);
  if (!made) return made.error();
  detector_ = std::move(*made);
  detector_made_for_ = image;
  detector_made_for_.bytes = {};
  channel_.height_px.store(static_cast<std::uint32_t>(image.height_px), std::memory_order_relaxed);
  channel_.width_px.store(static_cast<std::uint32_t>(image.width_px), std::memory_order_release);
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
    if (stop.stop_requested() && !pausing()) return;
    channel_.room.wait(ticket, kStopCheckPeriod);
  }
  deliver(Delivery::Delivering);
}

void CameraWorker::record(const std::stop_token& stop) {
  if (channel_.wake_recorder == nullptr) return;
  for (;;) {
    const WakeSignal::Ticket ticket = channel_.record_room.ticket();
    if (channel_.to_record->try_push(seen_)) break;
    if (!settings_.lossless) {
      channel_.counters.dropped_record_full.add();
      return;
    }
    if (stop.stop_requested() && !pausing()) return;
    channel_.record_room.wait(ticket, kStopCheckPeriod);
  }
  channel_.wake_recorder->signal();
}

// A device that is not there yet is no failure while its camera starts: it may boot, or be connected, later than the
// daemon.
CameraPhase CameraWorker::phase_after(const Error& error) const {
  const bool starting = phase_ == CameraPhase::Starting && error.code == ErrorCode::NotFound &&
                        host_now() - starting_at_ <= settings_.first_image_within;
  return starting ? CameraPhase::Starting : silent_ ? CameraPhase::Silent : CameraPhase::Reopening;
}

void CameraWorker::keep_for_take() {
  if (channel_.wake_take == nullptr) return;
  if (!channel_.to_take->try_push(seen_)) return channel_.counters.dropped_take_full.add();
  channel_.wake_take->signal();
}

// A recording waits for its host. A pause does not: there may be no host.
void CameraWorker::pass_to_node(const std::stop_token& stop) {
  if (channel_.wake_node == nullptr) return;
  for (;;) {
    const WakeSignal::Ticket ticket = channel_.node_room.ticket();
    if (channel_.to_node->try_push(seen_)) break;
    if (!settings_.lossless) {
      channel_.counters.dropped_queue_full.add();
      return;
    }
    if (stop.stop_requested()) return;
    channel_.node_room.wait(ticket, kStopCheckPeriod);
  }
  channel_.wake_node->signal();
}

void CameraWorker::offer_preview(const Frame& frame) {
  if (channel_.wake_preview != nullptr && channel_.preview.offer(frame, seen_.blobs)) channel_.wake_preview->signal();
}

// No wake-up: the calibration thread empties the queue many times a second while it collects images.
void CameraWorker::offer_calibration(const Image& image) {
  if (!channel_.calibrating.load(std::memory_order_acquire)) return;
  CalibrationImage wanted;
  wanted.exposed_at = seen_.exposed_at;
  wanted.width_px = image.width_px;
  wanted.height_px = image.height_px;
  for (const Blob& blob : seen_.blobs) {
    if (blob.touches_border || blob.merged) continue;
    if (!wanted.spots.try_push_back({blob.centroid, blob.sigma_px})) {
      wanted.spots.clear();
      break;
    }
  }
  if (!channel_.to_calibrate.try_push(wanted)) channel_.counters.dropped_calibration_full.add();
}

void CameraWorker::log_failure(const Error& error) {
  const CameraPhase phase = phase_after(error);
  const std::string reason = without_name(error.message, parts_.name);
  const bool starting = phase == CameraPhase::Starting;
  const Timestamp now = host_now();
  // Each reason is logged once, and again once a minute, so that a camera absent for a day does not fill the journal.
  // While a camera starts, only the first reason is logged: it may list the other cameras found so far.
  const bool repeated = !logged_reason_.empty() && phase == phase_ &&
                        (starting || without_digits(reason) == without_digits(logged_reason_));
  note(phase, reason);
  if (repeated && now - logged_at_ < kRepeatAfter) return;
  logged_reason_ = reason;
  logged_at_ = now;
  // A camera that fails together with others may be silent for their common reason, which its next start finds.
  silence_is_held_ = silent_ && parts_.failures != nullptr;
  if (silence_is_held_) return;
  if (parts_.failures != nullptr && !parts_.failures->is_news(starting ? kWaitsFor + reason : reason, now)) return;
  if (starting) {
    log_info("camera " + parts_.name,
             fmt::format("{}; waiting for it, at most {:.3g} s", reason, to_s(settings_.first_image_within)));
  } else {
    log_lost(reason, parts_.failures == nullptr ? "the other cameras" : "cameras without this fault");
  }
}

// The camera started again, so its silence had no common reason.
void CameraWorker::log_silence() {
  silence_is_held_ = false;
  log_lost(logged_reason_, "the other cameras");
}

void CameraWorker::log_lost(const std::string& reason, std::string_view others) const {
  log_error("camera " + parts_.name, fmt::format("{}; {} continue, retrying every {:.3g} s until it is back", reason,
                                                 others, to_s(settings_.longest_backoff)));
}

void CameraWorker::end_failure() {
  if (parts_.failures != nullptr && !logged_reason_.empty()) {
    parts_.failures->end(logged_reason_);
    parts_.failures->end(kWaitsFor + logged_reason_);
  }
  logged_reason_.clear();
}

void CameraWorker::note(CameraPhase phase, const std::string& error) {
  phase_ = phase;
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
    nap_.wait(ticket, std::min(left, kStopCheckPeriod));
  }
}

}  // namespace mocap::runtime
