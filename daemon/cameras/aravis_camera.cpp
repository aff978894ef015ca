#include "cameras/aravis_camera.h"

#include <fmt/format.h>
// Aravis's C headers do not keep our warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <future>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/aravis_discovery.h"
#include "cameras/clock_mapping.h"
#include "cameras/frame_counter.h"
#include "cameras/image_layout.h"

namespace mocap::cameras {
namespace {

// What a GigE stream may fall behind before the kernel drops packets; the kernel caps it at net.core.rmem_max.
constexpr int kSocketBuffer_bytes = 32 * 1024 * 1024;
// A camera answers within a network's round trip; a busy one within some tens of milliseconds.
constexpr Duration kAnswerPatience = std::chrono::milliseconds(400);
constexpr Duration kClosePatience = std::chrono::milliseconds(250);
// A clock said to be UTC may be this far from the receipt and still be believed.
constexpr Duration kUtcBelievable = std::chrono::seconds(10);

template <class T>
struct Unref {
  void operator()(T* object) const noexcept { g_object_unref(object); }
};
template <class T>
using Held = std::unique_ptr<T, Unref<T>>;

// Collects the GError of one call.
class Failure {
 public:
  Failure() = default;
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  ~Failure() { g_clear_error(&error_); }

  operator GError**() {
    g_clear_error(&error_);
    return &error_;
  }
  bool happened() const { return error_ != nullptr; }
  std::string text() const { return error_ != nullptr ? error_->message : "no reason given"; }
  ErrorCode code() const {
    if (error_ == nullptr || error_->domain != ARV_DEVICE_ERROR) return ErrorCode::Io;
    switch (error_->code) {
      case ARV_DEVICE_ERROR_NOT_FOUND: return ErrorCode::NotFound;
      case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND:
      case ARV_DEVICE_ERROR_WRONG_FEATURE: return ErrorCode::Unsupported;
      case ARV_DEVICE_ERROR_NOT_CONTROLLER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY: return ErrorCode::Busy;
      default: return ErrorCode::Io;
    }
  }

 private:
  GError* error_ = nullptr;
};

std::string text_of(const char* text) { return text != nullptr ? text : ""; }

std::optional<PixelFormat> pixel_format_of(ArvPixelFormat format) {
  constexpr ArvPixelFormat kMono10p = 0x010a0046;  // GenICam PFNC 2.4
  constexpr ArvPixelFormat kMono12p = 0x010c0047;
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8: return PixelFormat::Mono8;
    case ARV_PIXEL_FORMAT_MONO_10: return PixelFormat::Mono10;
    case ARV_PIXEL_FORMAT_MONO_12: return PixelFormat::Mono12;
    case kMono10p: return PixelFormat::Mono10p;
    case kMono12p: return PixelFormat::Mono12p;
    case ARV_PIXEL_FORMAT_MONO_10_PACKED: return PixelFormat::Mono10Packed;
    case ARV_PIXEL_FORMAT_MONO_12_PACKED: return PixelFormat::Mono12Packed;
    case ARV_PIXEL_FORMAT_BAYER_GR_8: return PixelFormat::BayerGr8;
    case ARV_PIXEL_FORMAT_BAYER_RG_8: return PixelFormat::BayerRg8;
    case ARV_PIXEL_FORMAT_BAYER_GB_8: return PixelFormat::BayerGb8;
    case ARV_PIXEL_FORMAT_BAYER_BG_8: return PixelFormat::BayerBg8;
    default: return std::nullopt;
  }
}

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

GQuark lost_mark() {
  static const GQuark mark = g_quark_from_static_string("mocap-control-lost");
  return mark;
}

void close(Held<ArvCamera> camera, Held<ArvStream> stream) {
  if (stream) arv_camera_stop_acquisition(camera.get(), nullptr);
  stream.reset();
  camera.reset();
}

// Closes a camera, waiting no longer than a live one takes. Of a camera that is gone Aravis takes leave for up to 12 s,
// asking again and again; that then goes on aside, on a thread that knows nothing of us.
void close_aside(Held<ArvCamera> camera, Held<ArvStream> stream) noexcept try {
  std::promise<void> closed;
  const std::future<void> done = closed.get_future();
  std::thread([c = std::move(camera), s = std::move(stream), told = std::move(closed)]() mutable {
    close(std::move(c), std::move(s));
    told.set_value();
  }).detach();
  done.wait_for(kClosePatience);
} catch (const std::exception& failure) {  // no thread to be had: the handles closed with the lambda
  log_warn("camera", fmt::format("closed without a thread: {}", failure.what()));
}

class AravisCamera : public Camera {
 public:
  AravisCamera(CameraId id, std::string name, AravisSettings settings, StreamCounters* counters)
      : id_(id), name_(std::move(name)), settings_(std::move(settings)), counters_(counters) {}
  ~AravisCamera() override { AravisCamera::stop(); }
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override;

 private:
  Status open();
  Status open_at_address();
  Status open_as(const std::string& device);
  bool lost() const;
  Status configure();
  Status set_pixel_format();
  Status set_region();
  Status set_number(const char* what, double value, void (*set)(ArvCamera*, double, GError**),
                    double (*get)(ArvCamera*, GError**), void (*bounds)(ArvCamera*, double*, double*, GError**));
  Status set_trigger();
  Status set_transport();
  Status open_stream();
  Status begin();
  Result<Frame> frame_of(ArvBuffer* buffer, Timestamp received);
  Timestamp exposed_at(Duration stamp, Timestamp received);
  void count_stream();
  void give_back();
  Error error(ErrorCode code, std::string_view what) const {
    return {code, fmt::format("camera '{}': {}", name_, what)};
  }
  Error error(const Failure& failure, std::string_view what) const {
    return error(failure.code(), fmt::format("{}: {}", what, failure.text()));
  }

  CameraId id_;
  std::string name_;
  AravisSettings settings_;
  StreamCounters* counters_;

  Held<ArvCamera> camera_;
  Held<ArvStream> stream_;
  ArvBuffer* lent_ = nullptr;  // ours until the next call
  bool was_there_ = false;
  bool software_trigger_ = false;
  bool trigger_due_ = false;
  Duration exposure_{};
  PixelFormat format_ = PixelFormat::Mono8;
  bool utc_doubted_ = false;
  Timestamp last_exposed_;
  ClockMapping clock_;
  FrameCounter frames_;
  std::array<std::uint64_t, 5> counted_{};  // of this stream: already in counters_
};

Status AravisCamera::start() {
  stop();
  Status done = begin();
  if (!done) stop();
  return done;
}

Status AravisCamera::begin() {
  clock_.reset();
  counted_ = {};
  if (Status opened = open(); !opened) return opened;
  if (Status configured = configure(); !configured) return configured;
  if (Status streaming = open_stream(); !streaming) return streaming;
  Failure failure;
  arv_camera_start_acquisition(camera_.get(), failure);
  if (failure.happened()) return error(failure, "cannot start the acquisition");
  trigger_due_ = software_trigger_;
  log_info("camera " + name_,
           fmt::format("started driver=aravis device={} exposure={:.0f}us",
                       text_of(arv_camera_get_model_name(camera_.get(), nullptr)), to_us(exposure_)));
  return {};
}

Status AravisCamera::open() {
  if (!settings_.address.empty()) return open_at_address();
  const std::vector<DiscoveredCamera> all = discover_cameras();
  if (!settings_.serial.empty()) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.serial == settings_.serial; });
    if (found != all.end()) return open_as(found->id);
    return error(ErrorCode::NotFound,
                 fmt::format("no Aravis camera with serial {}; {}", settings_.serial, listed(all)));
  }
  if (settings_.device_name.empty()) {
    return error(ErrorCode::InvalidArgument, "aravis needs one of serial, device_name and address");
  }
  Status opened = open_as(settings_.device_name);
  if (!opened && opened.error().code == ErrorCode::NotFound) {
    return error(ErrorCode::NotFound, fmt::format("no Aravis camera named {}; {}", settings_.device_name, listed(all)));
  }
  return opened;
}

// An address is asked directly: that reaches cameras whose network takes no broadcast.
Status AravisCamera::open_at_address() {
  if (gige_camera_answers(settings_.address, kAnswerPatience)) return open_as(settings_.address);
  // Who else is there helps the operator who mistyped; a camera that was there has lost its power or cable.
  const std::string others = was_there_ ? "check its power and cable" : listed(discover_cameras());
  return error(ErrorCode::NotFound, fmt::format("no Aravis camera answers at {}; {}", settings_.address, others));
}

Status AravisCamera::open_as(const std::string& device) {
  Failure failure;
  camera_.reset(arv_camera_new(device.c_str(), failure));
  if (!camera_) return error(failure, fmt::format("cannot open {}", device));
  if (arv_camera_is_gv_device(camera_.get()) &&
      !arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())))) {
    return error(ErrorCode::Busy, fmt::format("{} is controlled by another program; end that one", device));
  }
  was_there_ = true;
  // The heartbeat's thread marks the device and not us: it may still be at it when we are gone.
  g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost", G_CALLBACK(+[](ArvDevice* lost, gpointer) {
                     g_object_set_qdata(G_OBJECT(lost), lost_mark(), GINT_TO_POINTER(1));
                   }),
                   nullptr);
  return {};
}

bool AravisCamera::lost() const {
  return g_object_get_qdata(G_OBJECT(arv_camera_get_device(camera_.get())), lost_mark()) != nullptr;
}

Status AravisCamera::configure() {
  arv_camera_stop_acquisition(camera_.get(), nullptr);  // of a program that died while it streamed; idle cameras refuse
  arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);  // most have no other
  if (Status set = set_pixel_format(); !set) return set;
  if (Status set = set_region(); !set) return set;
  if (settings_.rate_hz) {
    Status set = set_number("rate_hz", *settings_.rate_hz, arv_camera_set_frame_rate, arv_camera_get_frame_rate,
                            arv_camera_get_frame_rate_bounds);
    if (!set) return set;
  }
  if (settings_.exposure_us) {
    arv_camera_set_exposure_time_auto(camera_.get(), ARV_AUTO_OFF, nullptr);  // many have no automatic
    Status set = set_number("exposure_us", *settings_.exposure_us, arv_camera_set_exposure_time,
                            arv_camera_get_exposure_time, arv_camera_get_exposure_time_bounds);
    if (!set) return set;
  }
  if (settings_.gain_db) {
    arv_camera_set_gain_auto(camera_.get(), ARV_AUTO_OFF, nullptr);
    Status set =
        set_number("gain_db", *settings_.gain_db, arv_camera_set_gain, arv_camera_get_gain, arv_camera_get_gain_bounds);
    if (!set) return set;
  }
  Failure failure;
  const double exposure_us = arv_camera_get_exposure_time(camera_.get(), failure);
  exposure_ = failure.happened() ? Duration::zero() : from_s(exposure_us * 1e-6);  // a camera that cannot tell
  if (Status set = set_trigger(); !set) return set;
  return set_transport();
}

Status AravisCamera::set_pixel_format() {
  Failure failure;
  arv_camera_set_pixel_format_from_string(camera_.get(), settings_.pixel_format.c_str(), failure);
  if (failure.happened()) {
    guint count = 0;
    const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera_.get(), &count, nullptr);
    std::string offered;
    for (guint i = 0; i < count; ++i) offered += fmt::format("{}{}", i == 0 ? "" : ", ", names[i]);
    g_free(names);
    return error(ErrorCode::Unsupported, fmt::format("pixel_format {} is refused ({}); the camera offers {}",
                                                     settings_.pixel_format, failure.text(), offered));
  }
  const std::optional<PixelFormat> known = pixel_format_of(arv_camera_get_pixel_format(camera_.get(), failure));
  if (failure.happened()) return error(failure, "cannot read the pixel format");
  if (!known) {
    return error(ErrorCode::Unsupported, fmt::format("pixel_format {} is not understood; use Mono8, Mono10, Mono12, "
                                                     "Mono10p or Mono12p",
                                                     settings_.pixel_format));
  }
  format_ = *known;
  return {};
}

Status AravisCamera::set_region() {
  if (!settings_.x_px && !settings_.y_px && !settings_.width_px && !settings_.height_px) return {};
  Failure failure;
  int x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera_.get(), &x, &y, &width, &height, failure);
  if (failure.happened()) return error(failure, "cannot read the region");
  const int wanted[] = {settings_.x_px.value_or(x), settings_.y_px.value_or(y), settings_.width_px.value_or(width),
                        settings_.height_px.value_or(height)};
  arv_camera_set_region(camera_.get(), wanted[0], wanted[1], wanted[2], wanted[3], failure);
  const std::string refusal = failure.happened() ? ": " + failure.text() : "";
  arv_camera_get_region(camera_.get(), &x, &y, &width, &height, failure);
  if (failure.happened()) return error(failure, "cannot read the region");
  int sensor_width = 0, sensor_height = 0;
  arv_camera_get_sensor_size(camera_.get(), &sensor_width, &sensor_height, failure);
  const bool inside = failure.happened() || (x + width <= sensor_width && y + height <= sensor_height);
  if (refusal.empty() && inside && std::equal(wanted, wanted + 4, std::array{x, y, width, height}.begin())) return {};
  return error(
      ErrorCode::InvalidArgument,
      fmt::format("region {}x{} at ({}, {}) is refused, the camera has {}x{} at ({}, {}) on a sensor of {}x{}{}",
                  wanted[2], wanted[3], wanted[0], wanted[1], width, height, x, y, sensor_width, sensor_height,
                  refusal));
}

Status AravisCamera::set_number(const char* what, double value, void (*set)(ArvCamera*, double, GError**),
                                double (*get)(ArvCamera*, GError**),
                                void (*bounds)(ArvCamera*, double*, double*, GError**)) {
  Failure failure;
  set(camera_.get(), value, failure);
  if (failure.happened()) return error(failure, fmt::format("{} = {} is refused", what, value));
  const double taken = get(camera_.get(), failure);
  if (failure.happened()) return error(failure, fmt::format("cannot read back {}", what));
  // Cameras round to their own steps; two hundredths are no longer a rounding.
  if (std::abs(taken - value) <= std::max(0.02 * std::abs(value), 0.1)) return {};
  double least = 0.0, most = 0.0;
  bounds(camera_.get(), &least, &most, nullptr);
  return error(ErrorCode::InvalidArgument,
               fmt::format("{} is {}, the camera took {}; expected {} to {}", what, value, taken, least, most));
}

Status AravisCamera::set_trigger() {
  software_trigger_ = settings_.trigger == "software";
  Failure failure;
  if (settings_.trigger == "free_run") {
    arv_camera_clear_triggers(camera_.get(), nullptr);  // a camera without triggers runs free
    return {};
  }
  arv_camera_set_trigger(camera_.get(), software_trigger_ ? "Software" : settings_.trigger.c_str(), failure);
  if (!failure.happened()) return {};
  guint count = 0;
  const char** names = arv_camera_dup_available_trigger_sources(camera_.get(), &count, nullptr);
  std::string offered;
  for (guint i = 0; i < count; ++i) offered += fmt::format("{}{}", i == 0 ? "" : ", ", names[i]);
  g_free(names);
  return error(ErrorCode::Unsupported,
               fmt::format("trigger {} is refused ({}); the camera offers {}", settings_.trigger, failure.text(),
                           offered.empty() ? "none" : offered));
}

Status AravisCamera::set_transport() {
  if (!arv_camera_is_gv_device(camera_.get())) return {};
  arv_camera_gv_set_stream_options(
      camera_.get(), settings_.packet_socket ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (!settings_.packet_size_bytes) return {};  // the stream negotiates when it is made
  Failure failure;
  arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera_.get(), *settings_.packet_size_bytes, failure);
  if (failure.happened())
    return error(failure, fmt::format("packet_size_bytes = {} is refused", *settings_.packet_size_bytes));
  return {};
}

Status AravisCamera::open_stream() {
  Failure failure;
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, failure));
  if (!stream_) return error(failure, "cannot open the stream");
  if (ARV_IS_GV_STREAM(stream_.get())) {
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 kSocketBuffer_bytes, nullptr);
  }
  const guint payload = arv_camera_get_payload(camera_.get(), failure);
  if (failure.happened() || payload == 0) return error(failure, "cannot read the size of an image");
  for (int i = 0; i < std::max(2, settings_.stream_buffers); ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new(payload, nullptr));
  }
  return {};
}

Result<Frame> AravisCamera::next(Duration patience) {
  give_back();
  if (!stream_ || lost()) {
    return error(ErrorCode::DeviceLost, stream_ ? "the camera stopped answering" : "not started");
  }
  if (trigger_due_) {
    Failure failure;
    arv_camera_software_trigger(camera_.get(), failure);
    if (failure.happened()) return error(failure, "cannot trigger");
    trigger_due_ = false;
  }
  const auto patience_us = std::chrono::duration_cast<std::chrono::microseconds>(patience).count();
  ArvBuffer* buffer = patience_us > 0 ? arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(patience_us))
                                      : arv_stream_try_pop_buffer(stream_.get());
  if (buffer == nullptr) {
    if (lost()) return error(ErrorCode::DeviceLost, "the camera stopped answering");
    return Error{ErrorCode::Timeout, {}};
  }
  const Timestamp received = host_now();
  lent_ = buffer;
  trigger_due_ = software_trigger_;
  count_stream();
  return frame_of(buffer, received);
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
  const std::size_t stride = packed_stride_bytes(format_, width);
  const std::size_t needed = luminance_bytes(format_, stride, width, height);
  if (width <= 0 || height <= 0 || size < needed) {
    return error(ErrorCode::Io, fmt::format("image {} came broken: {} bytes for {}x{}", frame_id, size, width, height));
  }
  Frame frame;
  frame.camera = id_;
  frame.number = frames_.number_of(frame_id);
  frame.received_at = received;
  frame.exposed_at = exposed_at(Duration{static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer))}, received);
  frame.image = {{static_cast<const std::byte*>(data), needed}, stride, width, height, format_};
  return frame;
}

Timestamp AravisCamera::exposed_at(Duration stamp, Timestamp received) {
  // The mapping learns from every frame, so that it is ready when the camera's UTC turns out to be none.
  Timestamp middle = clock_.map(stamp, received) - from_s(settings_.delivery_us * 1e-6) - exposure_ / 2;
  if (settings_.clock == "utc") {
    const Duration into_exposure = settings_.stamps == "start"    ? exposure_ / 2
                                   : settings_.stamps == "middle" ? Duration::zero()
                                                                  : -exposure_ / 2;
    const Timestamp told = Timestamp{stamp - utc_minus_host()} + into_exposure;
    if (told <= received + exposure_ && told > received - kUtcBelievable) {
      middle = told;
    } else if (!std::exchange(utc_doubted_, true)) {
      log_warn("camera " + name_,
               fmt::format("its clock is {:.3f}s off UTC; going on with clock = \"estimated\". Synchronise "
                           "it (PTP) or set that",
                           to_s(told - received)));
    }
  }
  // Images of one camera keep the order of their exposure, also while the mapping still learns.
  last_exposed_ = std::max(middle, last_exposed_ + Duration{1});
  return last_exposed_;
}

void AravisCamera::count_stream() {
  if (counters_ == nullptr) return;
  std::array<guint64, 5> now{};
  arv_stream_get_statistics(stream_.get(), &now[0], &now[1], &now[2]);
  if (ARV_IS_GV_STREAM(stream_.get())) arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &now[3], &now[4]);
  std::atomic<std::uint64_t>* const counters[] = {&counters_->completed_frames, &counters_->failed_frames,
                                                  &counters_->underruns, &counters_->resent_packets,
                                                  &counters_->missing_packets};
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] > counted_[i]) counters[i]->fetch_add(now[i] - counted_[i], std::memory_order_relaxed);
    counted_[i] = now[i];
  }
}

void AravisCamera::give_back() {
  if (lent_ != nullptr && stream_) arv_stream_push_buffer(stream_.get(), lent_);
  lent_ = nullptr;
}

void AravisCamera::stop() noexcept {
  give_back();
  if (!camera_) return;
  close_aside(std::move(camera_), std::move(stream_));
}

}  // namespace

std::unique_ptr<Camera> make_aravis_camera(CameraId id, std::string name, AravisSettings settings,
                                           StreamCounters* counters) {
  return std::make_unique<AravisCamera>(id, std::move(name), std::move(settings), counters);
}

}  // namespace mocap::cameras
