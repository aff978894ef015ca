#include "cameras/v4l2/v4l2_discovery.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "base/list_folder.h"

namespace mocap::cameras {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
std::string text_of(const __u8 (&text)[N]) {
  const char* const begin = reinterpret_cast<const char*>(text);
  return {begin, std::find(begin, begin + N, '\0')};
}

// Reads the file `serial` of the nearest parent device that has one, which is the USB device.
std::string serial_of(const std::string& node) {
  std::error_code missing;
  fs::path device = fs::canonical(fs::path("/sys/class/video4linux") / node / "device", missing);
  while (!missing && device.has_relative_path()) {
    std::string serial;
    if (std::ifstream file(device / "serial"); std::getline(file, serial)) return serial;
    device = device.parent_path();
  }
  return {};
}

std::optional<VideoNode> node_of(const std::string& name) {
  VideoNode node;
  node.device = fs::path("/dev") / name;
  const int handle = ::open(node.device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (handle < 0) return std::nullopt;
  v4l2_capability capability{};
  const bool known = ioctl(handle, VIDIOC_QUERYCAP, &capability) == 0;
  ::close(handle);
  const std::uint32_t able =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if (!known || (able & V4L2_CAP_VIDEO_CAPTURE) == 0) return std::nullopt;
  node.card = text_of(capability.card);
  node.driver = text_of(capability.driver);
  node.bus = text_of(capability.bus_info);
  node.serial = serial_of(name);
  return node;
}

int number_of(const std::string& name) { return std::atoi(name.c_str() + 5); }  // after "video"

std::string listed(const std::vector<VideoNode>& nodes) {
  std::string text;
  for (const VideoNode& node : nodes) {
    text += fmt::format("{}{} (bus {}{}{})", text.empty() ? "found " : ", ", node.device.string(), node.bus,
                        node.serial.empty() ? "" : ", serial ", node.serial);
  }
  return text.empty() ? "found none" : text;
}

}  // namespace

std::vector<VideoNode> list_video_nodes() {
  std::vector<std::string> names;
  for (const fs::path& device : list_folder("/sys/class/video4linux").paths) {
    const std::string name = device.filename().string();
    if (name.starts_with("video")) names.push_back(name);
  }
  std::sort(names.begin(), names.end(), [](const auto& a, const auto& b) { return number_of(a) < number_of(b); });
  std::vector<VideoNode> nodes;
  for (const std::string& name : names) {
    if (std::optional<VideoNode> node = node_of(name)) nodes.push_back(std::move(*node));
  }
  return nodes;
}

std::vector<KeyPairs> find_v4l2_cameras() {
  std::vector<KeyPairs> found;
  for (const VideoNode& each : list_video_nodes()) {
    found.push_back(
        {{"device", each.device.string()}, {"bus", each.bus}, {"serial", each.serial}, {"model", each.card}});
  }
  return found;
}

Result<fs::path> find_video_node(const V4l2Settings& settings) {
  if (!settings.device.empty()) return settings.device;
  const std::vector<VideoNode> nodes = list_video_nodes();
  for (const VideoNode& node : nodes) {
    // A camera has several nodes of one serial number; the first one that captures delivers the images.
    if (!settings.serial.empty() ? node.serial == settings.serial : node.bus == settings.bus) return node.device;
  }
  return Error{ErrorCode::NotFound,
               fmt::format("no video device with {} {}; {}", settings.serial.empty() ? "bus" : "serial",
                           settings.serial.empty() ? settings.bus : settings.serial, listed(nodes))};
}

}  // namespace mocap::cameras
