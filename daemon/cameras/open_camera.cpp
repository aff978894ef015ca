#include "cameras/open_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cameras/aravis/aravis_camera.h"
#include "cameras/aravis/aravis_describe.h"
#include "cameras/aravis/aravis_discovery.h"
#include "cameras/node/node_camera.h"
#include "cameras/replay/replay_camera.h"
#include "cameras/synthetic/synthetic_camera.h"
#include "cameras/tcp/tcp_camera.h"
#include "cameras/v4l2/v4l2_camera.h"
#include "cameras/v4l2/v4l2_discovery.h"

namespace mocap::cameras {
namespace {

// A new make is one line here: its settings, its open function, its discovery or kNotDiscoverable, and the functions
// that describe a camera's features if the make has them.
constexpr CameraMake kMakes[] = {
    make_with<AravisSettings, open_aravis_camera, find_aravis_cameras, describe_aravis_camera, aravis_settings_for>(),
    make_with<V4l2Settings, open_v4l2_camera, find_v4l2_cameras>(),
    make_with<ReplaySettings, open_replay_camera, kNotDiscoverable>(),
    make_with<SyntheticSettings, open_synthetic_camera, kNotDiscoverable>(),
    make_with<TcpSettings, open_tcp_camera, kNotDiscoverable>(),
    make_with<NodeCameraSettings, open_node_camera, kNotDiscoverable>(),
};

}  // namespace

std::span<const CameraMake> camera_makes() { return kMakes; }

const CameraMake* find_make(std::string_view driver) {
  const auto found = std::ranges::find(kMakes, driver, [](const CameraMake& make) { return make.name.driver; });
  return found != std::end(kMakes) ? &*found : nullptr;
}

std::vector<std::string_view> driver_words() {
  std::vector<std::string_view> words;
  for (const CameraMake& make : kMakes) words.push_back(make.name.driver);
  return words;
}

const std::string& driver_list() {
  static const std::string list = [words = driver_words()] {
    return fmt::format("{} or {}", fmt::join(words.begin(), words.end() - 1, ", "), words.back());
  }();
  return list;
}

Result<std::unique_ptr<Camera>> open_camera(CameraId id, const CameraSettings& settings,
                                            const CameraSurroundings& surroundings) {
  const auto refuse = [&](std::string_view why) {
    return Error{ErrorCode::InvalidArgument, fmt::format("camera '{}': {}", settings.name, why)};
  };
  const CameraMake* make = find_make(settings.driver.driver());
  if (make == nullptr) return refuse("driver is missing, expected " + driver_list());
  if (const std::vector<KeyFault> faults = settings.driver.all_faults(); !faults.empty()) {
    return refuse(faults.front().message);
  }
  return make->open(id, settings, surroundings);
}

}  // namespace mocap::cameras
