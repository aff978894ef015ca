#include "cameras/v4l2/v4l2_camera.h"

#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/clock/clock_mapping.h"
#include "cameras/clock/frame_counter.h"
#include "cameras/clock/leap_counter.h"
#include "cameras/image_layout.h"
#include "cameras/jpeg_decoder.h"
#include "cameras/v4l2/v4l2_device.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "cameras/v4l2/v4l2_formats.h"

namespace mocap::cameras {
namespace {

class V4l2Camera : public Camera {
 public:
  V4l2Camera(CameraId id, std::string name, V4l2Settings settings, StreamCounters* counters)
      : id_(id), device_(std::move(name)), settings_(std::move(settings)), counters_(counters) {}
  ~V4l2Camera() override { V4l2Camera::stop(); }
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override;
  std::optional<CameraAdjustment> adjustment() const override { return CameraAdjustment{settings_.exposure_us}; }
  Status adjust(const CameraAdjustment& to) override {
    if (to.gain_db)
      return Error{ErrorCode::Unsupported,
                   "the gain has the unit of the driver, not dB; set gain in the configuration"};
    settings_.exposure_us = to.exposure_us;
    return {};
  }

 private:
  struct Mapped {
    std::byte* data = nullptr;
    std::size_t size = 0;
  };

  Status begin();
  Status open_device();
  Status set_format();
  Status set_rate();
  Status set_controls();
  Status map_buffers();
  Status queue(std::uint32_t index);
  Result<Frame> frame_of(const v4l2_buffer& buffer, Timestamp received);
  Timestamp exposed_at(const v4l2_buffer& buffer, Timestamp received);
  void count_image();
  Error broken(const v4l2_buffer& buffer, const std::string& what);

  CameraId id_;
  V4l2Device device_;
  V4l2Settings settings_;
  StreamCounters* counters_;

  KnownFormat format_ = known_video_formats()[0];
  std::size_t stride_bytes_ = 0;
  Duration exposure_{};
  std::vector<Mapped> buffers_;
  std::optional<std::uint32_t> lent_;  // buffer of the driver that the caller uses until the next call
  bool stamps_invalid_ = false;
  ClockMapping clock_;
  LeapCounter leaps_;
  Timestamp last_exposed_;
  FrameCounter frames_;
  std::uint64_t frames_seen_ = 0;
  Duration last_stamp_{};
  std::uint32_t last_sequence_ = 0;
  JpegDecoder jpeg_;
};

Status V4l2Camera::start() {
  stop();
  Status done = begin();
  if (!done) stop();
  return done;
}

Status V4l2Camera::begin() {
  if (Status done = open_device(); !done) return done;
  if (Status done = set_format(); !done) return done;
  if (Status done = set_rate(); !done) return done;
  if (Status done = set_controls(); !done) return done;
  if (Status done = map_buffers(); !done) return done;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int reason = device_.call(VIDIOC_STREAMON, &type)) return device_.failed("VIDIOC_STREAMON", reason);
  stamps_invalid_ = false;
  clock_.reset();
  log_info("camera " + device_.name(),
           fmt::format("started driver=v4l2 device={} format={} size={}x{} exposure={:.0f}us", device_.path().string(),
                       format_.name, settings_.width_px, settings_.height_px, to_us(exposure_)));
  return {};
}

Status V4l2Camera::open_device() {
  const Result<std::filesystem::path> found = find_video_node(settings_);
  if (!found) return Error{found.error().code, fmt::format("camera '{}': {}", device_.name(), found.error().message)};
  return device_.open(*found);
}

Status V4l2Camera::set_format() {
  const std::span<const KnownFormat> all = known_video_formats();
  const auto known = std::find_if(all.begin(), all.end(),
                                  [&](const KnownFormat& each) { return settings_.pixel_format == each.name; });
  if (known == all.end()) {
    std::string names;
    for (const KnownFormat& each : all) names += (names.empty() ? "" : ", ") + std::string(each.name);
    return device_.error(ErrorCode::InvalidArgument,
                         fmt::format("pixel_format is {}, expected one of {}", settings_.pixel_format, names));
  }
  format_ = *known;
  v4l2_format wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.fmt.pix.width = static_cast<std::uint32_t>(settings_.width_px);
  wanted.fmt.pix.height = static_cast<std::uint32_t>(settings_.height_px);
  wanted.fmt.pix.pixelformat = format_.fourcc;
  wanted.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int reason = device_.call(VIDIOC_S_FMT, &wanted)) return device_.failed("VIDIOC_S_FMT", reason);
  const v4l2_pix_format& got = wanted.fmt.pix;
  if (got.pixelformat != format_.fourcc) {
    return device_.error(ErrorCode::Unsupported,
                         fmt::format("VIDIOC_S_FMT gave {} for pixel_format {}; the device offers {}",
                                     text_of_fourcc(got.pixelformat), format_.name, device_.offered_formats()));
  }
  if (got.width != static_cast<std::uint32_t>(settings_.width_px) ||
      got.height != static_cast<std::uint32_t>(settings_.height_px)) {
    return device_.error(ErrorCode::Unsupported,
                         fmt::format("VIDIOC_S_FMT gave {}x{} for {}x{}; set a size that the device has", got.width,
                                     got.height, settings_.width_px, settings_.height_px));
  }
  stride_bytes_ = std::max<std::size_t>(got.bytesperline, packed_stride_bytes(format_.format, settings_.width_px));
  return {};
}

Status V4l2Camera::set_rate() {
  v4l2_streamparm wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(settings_.rate_hz * 1000.0))};
  const int reason = device_.call(VIDIOC_S_PARM, &wanted);
  const v4l2_captureparm& got = wanted.parm.capture;
  if (reason == ENOTTY || reason == EINVAL || (reason == 0 && (got.capability & V4L2_CAP_TIMEPERFRAME) == 0)) {
    log_warn("camera " + device_.name(),
             fmt::format("{} has no settable rate; the rate of the device is used", device_.path().string()));
    return {};
  }
  if (reason != 0) return device_.failed("VIDIOC_S_PARM", reason);
  const double rate_hz = got.timeperframe.numerator == 0
                             ? 0.0
                             : static_cast<double>(got.timeperframe.denominator) / got.timeperframe.numerator;
  if (std::abs(rate_hz - settings_.rate_hz) <= 0.02 * settings_.rate_hz) return {};  // 29.97 Hz is accepted as 30 Hz
  return device_.error(ErrorCode::Unsupported,
                       fmt::format("VIDIOC_S_PARM gave {:.2f} Hz for rate_hz = {}; set a rate that the device "
                                   "has at {}x{}",
                                   rate_hz, settings_.rate_hz, settings_.width_px, settings_.height_px));
}

Status V4l2Camera::set_controls() {
  constexpr double kExposureUnit_us = 100.0;  // of V4L2_CID_EXPOSURE_ABSOLUTE
  if (settings_.exposure_us) {
    v4l2_control manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
    device_.call(VIDIOC_S_CTRL, &manual);  // a device without automatic exposure has no such control
    Status set =
        device_.set_control("exposure_us / 100", V4L2_CID_EXPOSURE_ABSOLUTE, *settings_.exposure_us / kExposureUnit_us);
    if (!set) return set;
  }
  if (settings_.gain) {
    v4l2_control manual{V4L2_CID_AUTOGAIN, 0};
    device_.call(VIDIOC_S_CTRL, &manual);
    if (Status set = device_.set_control("gain", V4L2_CID_GAIN, *settings_.gain); !set) return set;
  }
  v4l2_control exposure{V4L2_CID_EXPOSURE_ABSOLUTE, 0};
  const bool has_exposure = device_.call(VIDIOC_G_CTRL, &exposure) == 0;
  exposure_ = has_exposure ? from_s(exposure.value * kExposureUnit_us * 1e-6) : Duration::zero();
  return {};
}

Status V4l2Camera::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(std::max(2, settings_.buffers));
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int reason = device_.call(VIDIOC_REQBUFS, &request)) return device_.failed("VIDIOC_REQBUFS", reason);
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int reason = device_.call(VIDIOC_QUERYBUF, &buffer)) return device_.failed("VIDIOC_QUERYBUF", reason);
    void* mapped = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_.handle(), buffer.m.offset);
    if (mapped == MAP_FAILED) return device_.failed("mmap", errno);
    buffers_.push_back({static_cast<std::byte*>(mapped), buffer.length});
    if (Status queued = queue(index); !queued) return queued;
  }
  return {};
}

Status V4l2Camera::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (const int reason = device_.call(VIDIOC_QBUF, &buffer)) return device_.failed("VIDIOC_QBUF", reason);
  return {};
}

Result<Frame> V4l2Camera::next(Duration patience) {
  if (!device_.is_open()) return device_.error(ErrorCode::DeviceLost, "not started");
  if (lent_) {
    const std::uint32_t index = *std::exchange(lent_, std::nullopt);
    if (Status queued = queue(index); !queued) return queued.error();
  }
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec limit{static_cast<time_t>(whole.count()), static_cast<long>((patience - whole).count())};
  pollfd waiting{device_.handle(), POLLIN, 0};
  const int ready = ppoll(&waiting, 1, &limit, nullptr);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return Error{ErrorCode::Timeout, {}};
  if (ready < 0) return device_.failed("ppoll", errno);

  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int reason = device_.call(VIDIOC_DQBUF, &buffer);
  const Timestamp received = host_now();
  if (reason == EAGAIN && (waiting.revents & (POLLERR | POLLHUP)) == 0) return Error{ErrorCode::Timeout, {}};
  // Polling a device that was unplugged, or whose stream failed, reports an error for ever.
  if (reason != 0)
    return device_.error(ErrorCode::DeviceLost, fmt::format("VIDIOC_DQBUF failed: {}", std::strerror(reason)));
  if (buffer.index >= buffers_.size())
    return device_.error(ErrorCode::Io, "VIDIOC_DQBUF gave a buffer that is not ours");
  lent_ = buffer.index;
  return frame_of(buffer, received);
}

Error V4l2Camera::broken(const v4l2_buffer& buffer, const std::string& what) {
  if (counters_ != nullptr) counters_->failed_frames.fetch_add(1, std::memory_order_relaxed);
  return device_.error(ErrorCode::Io, fmt::format("image {} came broken: {}", buffer.sequence, what));
}

Result<Frame> V4l2Camera::frame_of(const v4l2_buffer& buffer, Timestamp received) {
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) return broken(buffer, "the driver says so");
  const Mapped& mapped = buffers_[buffer.index];
  std::span<const std::byte> bytes(mapped.data, std::min<std::size_t>(mapped.size, buffer.bytesused));
  const Duration stamp =
      std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec);
  if (frames_seen_++ > 0 && stamp == last_stamp_ && buffer.sequence == last_sequence_) {
    if (counters_ != nullptr) counters_->repeated_frames.fetch_add(1, std::memory_order_relaxed);
    return Error{ErrorCode::Timeout, {}};
  }
  last_stamp_ = stamp;
  last_sequence_ = buffer.sequence;
  Frame frame;
  frame.image = {bytes, stride_bytes_, settings_.width_px, settings_.height_px, format_.format};
  if (format_.format == PixelFormat::Mjpeg) {
    const auto grey = jpeg_.decode(bytes, settings_.width_px, settings_.height_px);
    if (!grey) return broken(buffer, grey.error().message);
    frame.image.bytes = *grey;
    frame.image.stride_bytes = static_cast<std::size_t>(settings_.width_px);
    frame.image.format = PixelFormat::Mono8;
  } else {
    const std::size_t needed = luminance_bytes(format_.format, stride_bytes_, settings_.width_px, settings_.height_px);
    if (bytes.size() < needed) return broken(buffer, fmt::format("{} bytes of {}", bytes.size(), needed));
  }
  frame.camera = id_;
  frame.number = frames_.number_of(buffer.sequence);
  frame.received_at = received;
  frame.exposed_at = exposed_at(buffer, received);
  count_image();
  return frame;
}

void V4l2Camera::count_image() {
  if (counters_ == nullptr) return;
  counters_->completed_frames.fetch_add(1, std::memory_order_relaxed);
  if (stamps_invalid_) {
    leaps_.count(clock_.leaps(), *counters_);
  } else {
    leaps_.skip(clock_.leaps());
  }
  counters_->clock_uncertainty_us.store(stamps_invalid_ ? to_us(clock_.uncertainty()) : 0.0, std::memory_order_relaxed);
  counters_->clock_source.store(stamps_invalid_ ? ClockSource::Receipts : ClockSource::Camera,
                                std::memory_order_relaxed);
}

Timestamp V4l2Camera::exposed_at(const v4l2_buffer& buffer, Timestamp received) {
  Timestamp stamp{std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec)};
  // Every frame is added to the mapping, so that it is ready when a stamp turns out to be invalid.
  const Timestamp mapped = clock_.map(stamp.time_since_epoch(), received);
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!stamps_invalid_ && (!monotonic || stamp > received)) {
    stamps_invalid_ = true;
    log_warn("camera " + device_.name(),
             fmt::format("{} stamps {}; going on with times estimated from the receipt", device_.path().string(),
                         monotonic ? "a time in the future" : "by a clock that it does not name"));
  }
  // Estimated times are those of the end of the frame, whatever the stamp means.
  const bool from_start =
      !stamps_invalid_ && (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  const Timestamp middle = from_start        ? stamp + exposure_ / 2
                           : stamps_invalid_ ? mapped - exposure_ / 2
                                             : stamp - exposure_ / 2;
  // Exposures of one camera must increase, also while the mapping converges.
  last_exposed_ = std::max(middle, last_exposed_ + Duration{1});
  return last_exposed_;
}

void V4l2Camera::stop() noexcept {
  if (!device_.is_open()) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_.call(VIDIOC_STREAMOFF, &type);
  for (const Mapped& mapped : buffers_) munmap(mapped.data, mapped.size);
  buffers_.clear();
  lent_.reset();
  device_.close();
}

}  // namespace

std::unique_ptr<Camera> make_v4l2_camera(CameraId id, std::string name, V4l2Settings settings,
                                         StreamCounters* counters) {
  return std::make_unique<V4l2Camera>(id, std::move(name), std::move(settings), counters);
}

Result<std::unique_ptr<Camera>> open_v4l2_camera(CameraId id, const std::string& name, const V4l2Settings& settings,
                                                 const CameraSurroundings& surroundings) {
  return make_v4l2_camera(id, name, settings, surroundings.counters);
}

}  // namespace mocap::cameras
