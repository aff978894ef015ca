#include "cameras/aravis/aravis_camera.h"

#include <fmt/format.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <future>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/aravis/aravis_chunks.h"
#include "cameras/aravis/aravis_device.h"
#include "cameras/aravis/aravis_failure.h"
#include "cameras/aravis/glib_text.h"
#include "cameras/clock/arrival_stamps.h"
#include "cameras/clock/exposure_clock.h"
#include "cameras/clock/frame_counter.h"
#include "cameras/clock/leap_counter.h"
#include "cameras/image_layout.h"

namespace mocap::cameras {
namespace {

// Limits of start() and close_aside(): a service that is terminated has 1 s for both (decisions/0004).
constexpr Duration kStartPatience = std::chrono::milliseconds(300);
constexpr Duration kClosePatience = std::chrono::milliseconds(250);
// Time from the arrival of a packet to the time stamp that Aravis's receive thread takes: the wake-up of a thread on an
// idle Linux machine (decisions/0008).
constexpr Duration kWaking = std::chrono::microseconds(40);
// A software trigger waits this long, and its exposure, for its image; silent_after_ms (500) would reopen the camera.
constexpr Duration kTriggerAgain = std::chrono::milliseconds(400);
// Longest transfer of an image, first byte to last byte. Design value.
constexpr Duration kLongestWay = std::chrono::seconds(1);

const char* reason_of(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT: return "packets missing when its time was over";
    case ARV_BUFFER_STATUS_MISSING_PACKETS: return "packets missing";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID: return "a packet with a wrong id";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH: return "larger than announced";
    case ARV_BUFFER_STATUS_ABORTED: return "broken off";
    default: return "not filled";
  }
}

using Opened = Result<std::unique_ptr<AravisDevice>>;

// Opens a camera on a separate thread that holds no object of the daemon: Aravis searches for about 1 s and may wait
// for an answer for several seconds. If the future is destroyed first, the thread closes the camera again.
std::future<Opened> open_aside(AravisSettings settings, Seen seen) {
  std::promise<Opened> promise;
  std::future<Opened> answer = promise.get_future();
  std::thread([settings = std::move(settings), seen, promise = std::move(promise)]() mutable {
    try {
      promise.set_value(open_aravis_device(settings, seen));
    } catch (const std::exception& failure) {
      promise.set_value(Error{ErrorCode::Io, failure.what()});
    }
  }).detach();
  return answer;
}

// Destroys `holder` on a separate thread and waits 250 ms at most, which is enough for a camera that answers. Closing a
// lost camera takes Aravis up to 12 s; the thread, which holds no object of the daemon, then continues alone
// (decisions/0004).
template <class Holder>
void close_aside(Holder holder) noexcept try {
  std::promise<void> closed;
  const std::future<void> done = closed.get_future();
  std::thread([held = std::optional<Holder>(std::move(holder)), promise = std::move(closed)]() mutable {
    held.reset();
    promise.set_value();
  }).detach();
  done.wait_for(kClosePatience);
} catch (const std::exception& failure) {
  // No thread could be created. The destruction of the lambda closed the camera.
  log_warn("camera", fmt::format("closed without a thread: {}", failure.what()));
}

class AravisCamera : public Camera {
 public:
  AravisCamera(CameraId id, std::string name, AravisSettings settings, StreamCounters* counters)
      : id_(id),
        name_(std::move(name)),
        settings_(std::move(settings)),
        counters_(counters),
        clock_(name_, settings_) {}
  ~AravisCamera() override;
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override;
  std::optional<CameraAdjustment> adjustment() const override {
    return CameraAdjustment{settings_.exposure_us, settings_.gain_db};
  }
  Status adjust(const CameraAdjustment& to) override {
    settings_.exposure_us = to.exposure_us;
    settings_.gain_db = to.gain_db;
    return {};
  }

 private:
  void open_anew();
  Status begin(std::unique_ptr<AravisDevice> device);
  Status trigger_if_due();
  ArvBuffer* wait_for_buffer(Duration patience);
  Result<Frame> frame_of(ArvBuffer* buffer, Timestamp received);
  std::unique_ptr<ArrivalStamps> stamps_of_arrival() const;
  Timestamp first_byte_at(ArvBuffer* buffer, Timestamp received);
  ImageInstants instants_of(ArvBuffer* buffer, Timestamp received);
  bool keeps_time() const;
  bool came_before(ArvBuffer* buffer);
  void count_stream();
  void count_clock();
  void give_back();
  Error error(ErrorCode code, std::string_view what) const {
    return {code, fmt::format("camera '{}': {}", name_, what)};
  }

  CameraId id_;
  std::string name_;
  AravisSettings settings_;
  StreamCounters* counters_;

  std::future<Opened> opening_;   // attempt in progress, or its result; survives stop()
  CameraAdjustment opened_with_;  // values with which this attempt began
  std::unique_ptr<AravisDevice> device_;
  ArvBuffer* lent_ = nullptr;  // in use by the caller until the next call
  Seen seen_ = Seen::Never;
  bool trigger_due_ = false;  // a software trigger: no image is expected
  Timestamp triggered_at_;    // the last software trigger
  ExposureClock clock_;
  std::optional<Duration> chunk_ahead_;      // chunk time minus leader time of the last image with both
  std::unique_ptr<ArrivalStamps> arrivals_;  // null: no permission, or not a network camera
  LeapCounter leaps_;
  FrameCounter frames_;
  std::uint64_t last_id_ = 0;
  std::uint64_t last_stamp_ns_ = 0;
  std::array<std::uint64_t, 5> counted_{};  // statistics of this stream that counters_ contain already
};

AravisCamera::~AravisCamera() {
  AravisCamera::stop();
  if (opening_.valid()) close_aside(std::move(opening_));
}

Status AravisCamera::start() try {
  stop();
  if (!opening_.valid()) open_anew();
  if (opening_.wait_for(kStartPatience) != std::future_status::ready) {
    return error(ErrorCode::Timeout, "still looking for the camera and opening it; start again for the result");
  }
  Opened opened = opening_.get();
  if (opened) seen_ = (*opened)->on_usb() ? Seen::OnUsb : Seen::OnNetwork;
  if (opened_with_.exposure_us != settings_.exposure_us || opened_with_.gain_db != settings_.gain_db) {
    if (opened) close_aside(*std::move(opened));  // first: a camera that is still open would refuse the next attempt
    open_anew();
    return error(ErrorCode::Timeout, "opening it again for the new exposure or gain; start again for the result");
  }
  if (!opened) return error(opened.error().code, opened.error().message);
  return begin(std::move(*opened));
} catch (const std::exception& failure) {
  return error(ErrorCode::Io, fmt::format("cannot create the thread that opens the camera: {}", failure.what()));
}

void AravisCamera::open_anew() {
  opening_ = open_aside(settings_, seen_);
  opened_with_ = {settings_.exposure_us, settings_.gain_db};
}

Status AravisCamera::begin(std::unique_ptr<AravisDevice> device) {
  device_ = std::move(device);
  clock_.reset();
  chunk_ahead_.reset();
  counted_ = {};
  arrivals_ = stamps_of_arrival();
  // The camera may have been lost since the attempt to open it ended.
  Status begun = device_->lost() ? error(ErrorCode::DeviceLost, "the camera stopped answering") : Status{};
  AravisFailure failure;
  if (begun) arv_camera_start_acquisition(device_->camera(), failure);
  if (failure.happened()) {
    const Error refused = failure.error("cannot start the acquisition");
    begun = error(refused.code, refused.message);
  }
  if (!begun) {
    stop();
    return begun;
  }
  trigger_due_ = device_->features().software_trigger;
  const AravisChunks* const chunks = device_->chunks();
  log_info("camera " + name_, fmt::format("started driver=aravis device={} exposure={:.0f}us chunks={}",
                                          text_of(arv_camera_get_model_name(device_->camera(), nullptr)),
                                          to_us(device_->features().exposure), chunks ? chunks->names() : "none"));
  return {};
}

Result<Frame> AravisCamera::next(Duration patience) {
  give_back();
  if (!device_ || device_->lost()) {
    return error(ErrorCode::DeviceLost, device_ ? "the camera stopped answering" : "not started");
  }
  if (Status triggered = trigger_if_due(); !triggered) return triggered.error();
  ArvBuffer* const buffer = wait_for_buffer(patience);
  if (buffer == nullptr) {
    if (device_->lost()) return error(ErrorCode::DeviceLost, "the camera stopped answering");
    // A second trigger while the image is on its way would make two images wait from then on.
    const AravisFeatures& features = device_->features();
    trigger_due_ = features.software_trigger && host_now() - triggered_at_ > kTriggerAgain + features.exposure;
    return Error{ErrorCode::Timeout, {}};
  }
  const Timestamp received = host_now();
  lent_ = buffer;
  count_stream();
  if (came_before(buffer)) return Error{ErrorCode::Timeout, {}};
  trigger_due_ = device_->features().software_trigger;
  Result<Frame> frame = frame_of(buffer, received);
  count_clock();
  return frame;
}

// Sends a software trigger if one is due: after each image, and after an image that was lost as a whole.
Status AravisCamera::trigger_if_due() {
  if (!trigger_due_) return {};
  AravisFailure failure;
  arv_camera_software_trigger(device_->camera(), failure);
  if (failure.happened()) {
    const Error refused = failure.error("cannot trigger");
    return error(refused.code, refused.message);
  }
  trigger_due_ = false;
  triggered_at_ = host_now();
  return {};
}

// Sends the action commands that are due during the wait, if this daemon triggers the camera.
ArvBuffer* AravisCamera::wait_for_buffer(Duration patience) {
  const auto pop = [this](Duration within) {
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(within).count();
    return us > 0 ? arv_stream_timeout_pop_buffer(device_->stream(), static_cast<guint64>(us))
                  : arv_stream_try_pop_buffer(device_->stream());
  };
  ActionTrigger* const trigger = device_->action_trigger();
  if (trigger == nullptr) return pop(patience);
  const Timestamp end = host_now() + patience;
  for (;;) {
    const Timestamp now = host_now();
    trigger->send_due(now, utc_minus_host(), settings_.ptp && device_->keeps_time());
    ArvBuffer* const buffer = pop(std::min(end, trigger->next_due()) - now);
    if (buffer != nullptr || host_now() >= end) return buffer;
  }
}

Result<Frame> AravisCamera::frame_of(ArvBuffer* buffer, Timestamp received) {
  const ArvBufferStatus status = arv_buffer_get_status(buffer);
  const std::uint64_t frame_id = arv_buffer_get_frame_id(buffer);
  if (status != ARV_BUFFER_STATUS_SUCCESS) {
    return error(ErrorCode::Io, fmt::format("image {} came broken: {}", frame_id, reason_of(status)));
  }
  std::size_t size = 0;
  const void* data = arv_buffer_get_data(buffer, &size);
  const int width = arv_buffer_get_image_width(buffer);
  const int height = arv_buffer_get_image_height(buffer);
  const PixelFormat format = device_->features().format;
  const std::size_t stride = packed_stride_bytes(format, width);
  const std::size_t needed = luminance_bytes(format, stride, width, height);
  if (width <= 0 || height <= 0 || size < needed) {
    return error(ErrorCode::Io, fmt::format("image {} came broken: {} bytes for {}x{}", frame_id, size, width, height));
  }
  Frame frame;
  frame.camera = id_;
  frame.number = frames_.number_of(frame_id);
  frame.received_at = received;
  frame.exposed_at = clock_.middle_of(instants_of(buffer, received), keeps_time());
  frame.image = {{static_cast<const std::byte*>(data), needed}, stride, width, height, format};
  return frame;
}

std::unique_ptr<ArrivalStamps> AravisCamera::stamps_of_arrival() const {
  ArvDevice* const device = arv_camera_get_device(device_->camera());
  if (!ARV_IS_GV_DEVICE(device) || !ARV_IS_GV_STREAM(device_->stream())) return nullptr;
  auto* const at = G_INET_SOCKET_ADDRESS(arv_gv_device_get_device_address(ARV_GV_DEVICE(device)));
  GInetAddress* const address = g_inet_socket_address_get_address(at);
  if (g_inet_address_get_family(address) != G_SOCKET_FAMILY_IPV4) return nullptr;
  in_addr camera{};
  std::memcpy(&camera, g_inet_address_to_bytes(address), sizeof camera);
  return ArrivalStamps::open(camera, arv_gv_stream_get_port(ARV_GV_STREAM(device_->stream())));
}

// Arrival of the image's first packet; later packets contain no information about the camera's clock. The stamp of the
// kernel or of Aravis is UTC, which may be stepped, so a time outside of the possible range is replaced by `received`.
Timestamp AravisCamera::first_byte_at(ArvBuffer* buffer, Timestamp received) {
  std::optional<Duration> utc;
  if (arrivals_) utc = arrivals_->arrival_utc(arv_buffer_get_frame_id(buffer));
  if (!utc) utc = Duration{static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer))} - kWaking;
  const Timestamp first{*utc - utc_minus_host()};
  return first < received && received - first < kLongestWay ? first : received;
}

// Stamp and exposure from chunk data if the image has them. An image that lost its chunk data uses the stamp in its
// leader and the difference of chunk time and leader time of the last image that had both.
ImageInstants AravisCamera::instants_of(ArvBuffer* buffer, Timestamp received) {
  ImageInstants image{};
  image.stamp = Duration{static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer))};
  image.exposure = device_->features().exposure;
  image.first_byte = first_byte_at(buffer, received);
  image.received = received;
  image.utc_minus_host = utc_minus_host();
  if (AravisChunks* const chunks = device_->chunks()) {
    const AravisChunks::Values values = chunks->read(buffer);
    if (values.exposure) image.exposure = *values.exposure;
    if (values.begin) chunk_ahead_ = *values.begin - image.stamp;
    if (chunk_ahead_) image.stamp += *chunk_ahead_;
  }
  if (ActionTrigger* const trigger = device_->action_trigger()) trigger->read_clock(image);
  image.stamp_tells_begin = chunk_ahead_.has_value();
  return image;
}

// The PTP state is read every 2 s only; a refused action command shows the loss of the master immediately.
bool AravisCamera::keeps_time() const {
  const ActionTrigger* const trigger = device_->action_trigger();
  return device_->keeps_time() && (trigger == nullptr || !trigger->refused());
}

// True for an image that came before: a network duplicated its packets, or the camera sent it twice. An image without a
// time stamp is never a repetition here; FrameCounter treats its id.
bool AravisCamera::came_before(ArvBuffer* buffer) {
  const std::uint64_t stamp_ns = arv_buffer_get_timestamp(buffer);
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  const bool again = stamp_ns != 0 && stamp_ns == last_stamp_ns_ && id == last_id_;
  last_stamp_ns_ = stamp_ns;
  last_id_ = id;
  if (again && counters_ != nullptr) counters_->repeated_frames.fetch_add(1, std::memory_order_relaxed);
  return again;
}

void AravisCamera::count_clock() {
  if (counters_ == nullptr) return;
  leaps_.count(clock_.leaps(), *counters_);
  counters_->clock_uncertainty_us.store(to_us(clock_.uncertainty()), std::memory_order_relaxed);
  counters_->clock_source.store(clock_.source(), std::memory_order_relaxed);
  counters_->chunk_times.store(chunk_ahead_.has_value(), std::memory_order_relaxed);
}

void AravisCamera::count_stream() {
  if (counters_ == nullptr) return;
  std::array<guint64, 5> now{};
  arv_stream_get_statistics(device_->stream(), &now[0], &now[1], &now[2]);
  if (ARV_IS_GV_STREAM(device_->stream()))
    arv_gv_stream_get_statistics(ARV_GV_STREAM(device_->stream()), &now[3], &now[4]);
  std::atomic<std::uint64_t>* const counters[] = {&counters_->completed_frames, &counters_->failed_frames,
                                                  &counters_->underruns, &counters_->resent_packets,
                                                  &counters_->missing_packets};
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] > counted_[i]) counters[i]->fetch_add(now[i] - counted_[i], std::memory_order_relaxed);
    counted_[i] = now[i];
  }
}

void AravisCamera::give_back() {
  if (lent_ != nullptr && device_) arv_stream_push_buffer(device_->stream(), lent_);
  lent_ = nullptr;
}

void AravisCamera::stop() noexcept {
  give_back();
  if (device_) close_aside(std::move(device_));
}

}  // namespace

std::unique_ptr<Camera> make_aravis_camera(CameraId id, std::string name, AravisSettings settings,
                                           StreamCounters* counters) {
  return std::make_unique<AravisCamera>(id, std::move(name), std::move(settings), counters);
}

Result<std::unique_ptr<Camera>> open_aravis_camera(CameraId id, const std::string& name, const AravisSettings& settings,
                                                   const CameraSurroundings& surroundings) {
  return make_aravis_camera(id, name, settings, surroundings.counters);
}

}  // namespace mocap::cameras
