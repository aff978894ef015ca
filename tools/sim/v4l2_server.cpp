#include "v4l2_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/log.h"
#include "base/time.h"
#include "stage.h"

namespace mocap::sim {
namespace {

constexpr int kQuality = 90;
constexpr Duration kLookAtStop = std::chrono::milliseconds(20);

std::vector<std::byte> compressed(const std::vector<std::byte>& grey, int width_px, int height_px) {
  const tjhandle handle = tjInitCompress();
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  std::vector<std::byte> bytes;
  if (tjCompress2(handle, reinterpret_cast<const unsigned char*>(grey.data()), width_px, 0, height_px, TJPF_GRAY, &jpeg,
                  &size, TJSAMP_GRAY, kQuality, TJFLAG_FASTDCT) == 0) {
    const auto* const begin = reinterpret_cast<const std::byte*>(jpeg);
    bytes.assign(begin, begin + size);
  }
  tjFree(jpeg);
  tjDestroy(handle);
  return bytes;
}

class LoopbackCamera {
 public:
  LoopbackCamera(const Options& options, const scene::Volume& volume, std::size_t camera)
      : model_(volume.rig()[camera]), device_(options.v4l2[camera]), rate_hz_(options.rate_hz) {
    const int count = options.loop_images > 0 ? options.loop_images : kUsualLoop;
    const Loop loop(volume, camera, count, options.rate_hz, 1e-6 * options.exposure_us);
    jpeg_ = options.v4l2_format == "MJPEG";
    for (int i = 0; i < 2 * count - 2; ++i) {
      const std::vector<std::byte>& grey = loop.image(i);
      images_.push_back(jpeg_ ? compressed(grey, model_.width_px, model_.height_px) : grey);
    }
  }
  ~LoopbackCamera() {
    thread_ = {};
    if (handle_ >= 0) close(handle_);
  }
  LoopbackCamera(const LoopbackCamera&) = delete;
  LoopbackCamera& operator=(const LoopbackCamera&) = delete;

  Status begin() {
    handle_ = open(device_.c_str(), O_RDWR | O_CLOEXEC);
    if (handle_ < 0) return Error{ErrorCode::NotFound, fmt::format("{}: {}", device_, std::strerror(errno))};
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = static_cast<std::uint32_t>(model_.width_px);
    format.fmt.pix.height = static_cast<std::uint32_t>(model_.height_px);
    format.fmt.pix.pixelformat = jpeg_ ? V4L2_PIX_FMT_MJPEG : V4L2_PIX_FMT_GREY;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.sizeimage = format.fmt.pix.width * format.fmt.pix.height;
    if (ioctl(handle_, VIDIOC_S_FMT, &format) != 0) {
      return Error{ErrorCode::Unsupported,
                   fmt::format("{} does not accept {}x{} images: {}; is it a v4l2loopback device?", device_,
                               model_.width_px, model_.height_px, std::strerror(errno))};
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    log_info("camera " + model_.name,
             fmt::format("shown on {} size={}x{}", device_, model_.width_px, model_.height_px));
    return {};
  }

 private:
  void run(const std::stop_token& stop) {
    const auto period_ns = static_cast<std::int64_t>(1e9 / rate_hz_);
    std::int64_t number = to_ns(host_now()) / period_ns;
    while (!stop.stop_requested()) {
      number = std::max(number + 1, to_ns(host_now()) / period_ns);
      while (to_ns(host_now()) < number * period_ns && !stop.stop_requested()) {
        std::this_thread::sleep_for(std::min<Duration>(Duration{number * period_ns - to_ns(host_now())}, kLookAtStop));
      }
      const std::vector<std::byte>& image = images_[static_cast<std::size_t>(number) % images_.size()];
      if (write(handle_, image.data(), image.size()) < 0) {
        log_warn("camera " + model_.name, fmt::format("{}: {}", device_, std::strerror(errno)));
        return;
      }
    }
  }

  const CameraModel& model_;
  std::string device_;
  double rate_hz_;
  bool jpeg_ = false;
  std::vector<std::vector<std::byte>> images_;
  int handle_ = -1;
  std::jthread thread_;
};

}  // namespace

Status serve_v4l2(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end) {
  if (options.v4l2.size() > volume.rig().size()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("--v4l2 names {} devices, the rig has {} cameras",
                                                         options.v4l2.size(), volume.rig().size())};
  }
  std::vector<std::unique_ptr<LoopbackCamera>> cameras;
  for (std::size_t i = 0; i < options.v4l2.size(); ++i) {
    cameras.push_back(std::make_unique<LoopbackCamera>(options, volume, i));
    if (const Status begun = cameras.back()->begin(); !begun) return begun;
  }
  const Timestamp began_at = host_now();
  while (!end && (options.seconds <= 0.0 || to_s(host_now() - began_at) < options.seconds)) {
    std::this_thread::sleep_for(kLookAtStop);
  }
  return {};
}

}  // namespace mocap::sim
