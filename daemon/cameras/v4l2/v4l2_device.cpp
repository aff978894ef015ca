#include "cameras/v4l2/v4l2_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "cameras/v4l2/v4l2_formats.h"

namespace mocap::cameras {

Status V4l2Device::open(const std::filesystem::path& path) {
  close();
  path_ = path;
  handle_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (!is_open()) {
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

void V4l2Device::close() noexcept {
  if (is_open()) ::close(handle_);
  handle_ = kNone;
}

int V4l2Device::call(unsigned long request, void* argument) const {
  int done = 0;
  do {
    done = ioctl(handle_, request, argument);
  } while (done < 0 && errno == EINTR);
  return done < 0 ? errno : 0;
}

Status V4l2Device::set_control(const char* what, std::uint32_t control, double value) const {
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

std::string V4l2Device::offered_formats() const {
  std::string offered;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; call(VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    offered += (offered.empty() ? "" : ", ") + text_of_fourcc(description.pixelformat);
  }
  return offered.empty() ? "none" : offered;
}

Error V4l2Device::error(ErrorCode code, const std::string& what) const {
  return {code, fmt::format("camera '{}': {}: {}", name_, path_.string(), what)};
}

Error V4l2Device::failed(const char* request, int reason) const {
  const ErrorCode code = reason == ENODEV                       ? ErrorCode::DeviceLost
                         : reason == EBUSY                      ? ErrorCode::Busy
                         : reason == EINVAL || reason == ENOTTY ? ErrorCode::Unsupported
                                                                : ErrorCode::Io;
  return error(code, fmt::format("{} failed: {}", request, std::strerror(reason)));
}

}  // namespace mocap::cameras
