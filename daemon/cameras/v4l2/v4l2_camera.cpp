#include "cameras/v4l2/v4l2_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

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
#include "cameras/image_layout.h"
#include "cameras/jpeg_decoder.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "cameras/v4l2/v4l2_formats.h"

namespace mocap::cameras {
namespace {

constexpr int kNone = -1;

class V4l2Camera : public Camera {
 public:
  V4l2Camera(CameraId id, std::string name, V4l2Settings settings, StreamCounters* counters)
      : id_(id), name_(std::move(name)), settings_(std::move(settings)), counters_(counters) {}
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
  Status set_control(const char* what, std::uint32_t control, double value);
  Status map_buffers();
  std::string offered_formats() const;
  Status queue(std::uint32_t index);
  Result<Frame> frame_of(const v4l2_buffer& buffer, Timestamp received);
  Timestamp exposed_at(const v4l2_buffer& buffer, Timestamp received);
  Error broken(const v4l2_buffer& buffer, const std::string& what);

  // Calls ioctl, again if a signal interrupts it. Returns 0 or errno.
  int call(unsigned long request, void* argument) const {
    int done = 0;
    do {
      done = ioctl(device_, request, argument);
    } while (done < 0 && errno == EINTR);
    return done < 0 ? errno : 0;
  }
  Error error(ErrorCode code, const std::string& what) const {
    return {code, fmt::format("camera '{}': {}: {}", name_, path_.string(), what)};
  }
  Error failed(const char* request, int reason) const {
    const ErrorCode code = reason == ENODEV                       ? ErrorCode::DeviceLost
                           : reason == EBUSY                      ? ErrorCode::Busy
                           : reason == EINVAL || reason == ENOTTY ? ErrorCode::Unsupported
                                                                  : ErrorCode::Io;
    return error(code, fmt::format("{} failed: {}", request, std::strerror(reason)));
  }

  CameraId id_;
  std::string name_;
  V4l2Settings settings_;
  StreamCounters* counters_;

  std::filesystem::path path_;  // device node at the last start()
  int device_ = kNone;
  KnownFormat format_ = known_video_formats()[0];
  std::size_t stride_bytes_ = 0;
  Duration exposure_{};
  std::vector<Mapped> buffers_;
  std::optional<std::uint32_t> lent_;  // buffer of the driver that the caller uses until the next call
  bool stamps_invalid_ = false;
  ClockMapping clock_;
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
  if (const int reason = call(VIDIOC_STREAMON, &type)) return failed("VIDIOC_STREAMON", reason);
  stamps_invalid_ = false;
  clock_.reset();
  log_info("camera " + name_,
           fmt::format("started driver=v4l2 device={} format={} size={}x{} exposure={:.0f}us", path_.string(),
                       format_.name, settings_.width_px, settings_.height_px, to_us(exposure_)));
  return {};
}

Status V4l2Camera::open_device() {
  const Result<std::filesystem::path> found = find_video_node(settings_);
  if (!found) return Error{found.error().code, fmt::format("camera '{}': {}", name_, found.error().message)};
  path_ = *found;
  device_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (device_ < 0) {
    const int reason = errno;
    const ErrorCode code = reason == ENOENT || reason == ENODEV || reason == ENXIO ? ErrorCode::NotFound
                           : reason == EBUSY                                       ? ErrorCode::Busy
                                                                                   : ErrorCode::Io;
    return error(code, fmt::format("cannot open: {}{}", std::strerror(reason),
                                   reason == EACCES ? "; add the user to the group 'video'" : ""));
  }
  v4l2_capability capability{};
  if (const int reason = call(VIDIOC_QUERYCAP, &capability)) {
    return error(ErrorCode::Unsupported,
                 fmt::format("VIDIOC_QUERYCAP failed: {}; not a video device", std::strerror(reason)));
  }
  const std::uint32_t able =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0 || (able & V4L2_CAP_STREAMING) == 0) {
    return error(ErrorCode::Unsupported,
                 "does not capture video by streaming; a camera has several nodes, use another one");
  }
  return {};
}

std::string V4l2Camera::offered_formats() const {
  std::string offered;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; call(VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    offered += (offered.empty() ? "" : ", ") + text_of_fourcc(description.pixelformat);
  }
  return offered.empty() ? "none" : offered;
}

Status V4l2Camera::set_format() {
  const std::span<const KnownFormat> all = known_video_formats();
  const auto known = std::find_if(all.begin(), all.end(),
                                  [&](const KnownFormat& each) { return settings_.pixel_format == each.name; });
  if (known == all.end()) {
    return error(ErrorCode::InvalidArgument,
                 fmt::format("pixel_format is {}, expected GREY, Y10, YUYV, NV12 or MJPEG", settings_.pixel_format));
  }
  format_ = *known;
  v4l2_format wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.fmt.pix.width = static_cast<std::uint32_t>(settings_.width_px);
  wanted.fmt.pix.height = static_cast<std::uint32_t>(settings_.height_px);
  wanted.fmt.pix.pixelformat = format_.fourcc;
  wanted.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int reason = call(VIDIOC_S_FMT, &wanted)) return failed("VIDIOC_S_FMT", reason);
  const v4l2_pix_format& got = wanted.fmt.pix;
  if (got.pixelformat != format_.fourcc) {
    return error(ErrorCode::Unsupported, fmt::format("VIDIOC_S_FMT gave {} for pixel_format {}; the device offers {}",
                                                     text_of_fourcc(got.pixelformat), format_.name, offered_formats()));
  }
  if (got.width != static_cast<std::uint32_t>(settings_.width_px) ||
      got.height != static_cast<std::uint32_t>(settings_.height_px)) {
    return error(ErrorCode::Unsupported,
                 fmt::format("VIDIOC_S_FMT gave {}x{} for {}x{}; set a size that the device has", got.width, got.height,
                             settings_.width_px, settings_.height_px));
  }
  stride_bytes_ = std::max<std::size_t>(got.bytesperline, packed_stride_bytes(format_.format, settings_.width_px));
  return {};
}

Status V4l2Camera::set_rate() {
  v4l2_streamparm wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(settings_.rate_hz * 1000.0))};
  const int reason = call(VIDIOC_S_PARM, &wanted);
  const v4l2_captureparm& got = wanted.parm.capture;
  if (reason == ENOTTY || reason == EINVAL || (reason == 0 && (got.capability & V4L2_CAP_TIMEPERFRAME) == 0)) {
    log_warn("camera " + name_, fmt::format("{} has no settable rate; the rate of the device is used", path_.string()));
    return {};
  }
  if (reason != 0) return failed("VIDIOC_S_PARM", reason);
  const double rate_hz = got.timeperframe.numerator == 0
                             ? 0.0
                             : static_cast<double>(got.timeperframe.denominator) / got.timeperframe.numerator;
  if (std::abs(rate_hz - settings_.rate_hz) <= 0.02 * settings_.rate_hz) return {};  // 29.97 Hz is accepted as 30 Hz
  return error(ErrorCode::Unsupported,
               fmt::format("VIDIOC_S_PARM gave {:.2f} Hz for rate_hz = {}; set a rate that the device "
                           "has at {}x{}",
                           rate_hz, settings_.rate_hz, settings_.width_px, settings_.height_px));
}

Status V4l2Camera::set_control(const char* what, std::uint32_t control, double value) {
  v4l2_queryctrl range{};
  range.id = control;
  if (const int reason = call(VIDIOC_QUERYCTRL, &range)) {
    return error(ErrorCode::Unsupported,
                 fmt::format("VIDIOC_QUERYCTRL failed: {}; the device has no {}", std::strerror(reason), what));
  }
  const long wanted = std::lround(value);
  if (wanted < range.minimum || wanted > range.maximum) {
    return error(ErrorCode::InvalidArgument, fmt::format("{} is {} in the driver's unit, expected {} to {}", what,
                                                         wanted, range.minimum, range.maximum));
  }
  v4l2_control set{control, static_cast<std::int32_t>(wanted)};
  if (const int reason = call(VIDIOC_S_CTRL, &set)) {
    Error refused = failed("VIDIOC_S_CTRL", reason);
    refused.message += fmt::format(" ({} = {})", what, wanted);
    return refused;
  }
  return {};
}

Status V4l2Camera::set_controls() {
  constexpr double kExposureUnit_us = 100.0;  // of V4L2_CID_EXPOSURE_ABSOLUTE
  if (settings_.exposure_us) {
    v4l2_control manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
    call(VIDIOC_S_CTRL, &manual);  // a device without automatic exposure has no such control
    Status set =
        set_control("exposure_us / 100", V4L2_CID_EXPOSURE_ABSOLUTE, *settings_.exposure_us / kExposureUnit_us);
    if (!set) return set;
  }
  if (settings_.gain) {
    v4l2_control manual{V4L2_CID_AUTOGAIN, 0};
    call(VIDIOC_S_CTRL, &manual);
    if (Status set = set_control("gain", V4L2_CID_GAIN, *settings_.gain); !set) return set;
  }
  v4l2_control exposure{V4L2_CID_EXPOSURE_ABSOLUTE, 0};
  const bool has_exposure = call(VIDIOC_G_CTRL, &exposure) == 0;
  exposure_ = has_exposure ? from_s(exposure.value * kExposureUnit_us * 1e-6) : Duration::zero();
  return {};
}

Status V4l2Camera::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(std::max(2, settings_.buffers));
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int reason = call(VIDIOC_REQBUFS, &request)) return failed("VIDIOC_REQBUFS", reason);
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int reason = call(VIDIOC_QUERYBUF, &buffer)) return failed("VIDIOC_QUERYBUF", reason);
    void* mapped = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_, buffer.m.offset);
    if (mapped == MAP_FAILED) return failed("mmap", errno);
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
  if (const int reason = call(VIDIOC_QBUF, &buffer)) return failed("VIDIOC_QBUF", reason);
  return {};
}

Result<Frame> V4l2Camera::next(Duration patience) {
  if (device_ == kNone) return error(ErrorCode::DeviceLost, "not started");
  if (lent_) {
    const std::uint32_t index = *std::exchange(lent_, std::nullopt);
    if (Status queued = queue(index); !queued) return queued.error();
  }
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec limit{static_cast<time_t>(whole.count()), static_cast<long>((patience - whole).count())};
  pollfd waiting{device_, POLLIN, 0};
  const int ready = ppoll(&waiting, 1, &limit, nullptr);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return Error{ErrorCode::Timeout, {}};
  if (ready < 0) return failed("ppoll", errno);

  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int reason = call(VIDIOC_DQBUF, &buffer);
  const Timestamp received = host_now();
  if (reason == EAGAIN && (waiting.revents & (POLLERR | POLLHUP)) == 0) return Error{ErrorCode::Timeout, {}};
  // Polling a device that was unplugged, or whose stream failed, reports an error for ever.
  if (reason != 0) return error(ErrorCode::DeviceLost, fmt::format("VIDIOC_DQBUF failed: {}", std::strerror(reason)));
  if (buffer.index >= buffers_.size()) return error(ErrorCode::Io, "VIDIOC_DQBUF gave a buffer that is not ours");
  lent_ = buffer.index;
  return frame_of(buffer, received);
}

Error V4l2Camera::broken(const v4l2_buffer& buffer, const std::string& what) {
  if (counters_ != nullptr) counters_->failed_frames.fetch_add(1, std::memory_order_relaxed);
  return error(ErrorCode::Io, fmt::format("image {} came broken: {}", buffer.sequence, what));
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
  if (counters_ != nullptr) {
    counters_->completed_frames.fetch_add(1, std::memory_order_relaxed);
    counters_->clock_uncertainty_us.store(stamps_invalid_ ? to_us(clock_.uncertainty()) : 0.0,
                                          std::memory_order_relaxed);
  }
  return frame;
}

Timestamp V4l2Camera::exposed_at(const v4l2_buffer& buffer, Timestamp received) {
  Timestamp stamp{std::chrono::seconds(buffer.timestamp.tv_sec) + std::chrono::microseconds(buffer.timestamp.tv_usec)};
  // Every frame is added to the mapping, so that it is ready when a stamp turns out to be invalid.
  const Timestamp mapped = clock_.map(stamp.time_since_epoch(), received);
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!stamps_invalid_ && (!monotonic || stamp > received)) {
    stamps_invalid_ = true;
    log_warn("camera " + name_,
             fmt::format("{} stamps {}; going on with times estimated from the receipt", path_.string(),
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
  if (device_ == kNone) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  call(VIDIOC_STREAMOFF, &type);
  for (const Mapped& mapped : buffers_) munmap(mapped.data, mapped.size);
  buffers_.clear();
  lent_.reset();
  ::close(device_);
  device_ = kNone;
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
