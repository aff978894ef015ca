#include "cameras/open_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cameras/aravis/aravis_camera.h"
#include "cameras/replay/replay_camera.h"
#include "cameras/synthetic/synthetic_camera.h"
#include "cameras/tcp/tcp_camera.h"
#include "cameras/v4l2/v4l2_camera.h"

namespace mocap::cameras {
namespace {

// A new make is one line here.
constexpr CameraMake kMakes[] = {
    make_with<AravisSettings, open_aravis_camera>(), make_with<V4l2Settings, open_v4l2_camera>(),
    make_with<ReplaySettings, open_replay_camera>(), make_with<SyntheticSettings, open_synthetic_camera>(),
    make_with<TcpSettings, open_tcp_camera>(),
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
