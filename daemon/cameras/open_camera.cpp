#include "cameras/open_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "cameras/aravis/aravis_camera.h"
#include "cameras/replay/replay_camera.h"
#include "cameras/synthetic/synthetic_camera.h"
#include "cameras/v4l2/v4l2_camera.h"
#include "scene/program.h"

namespace mocap::cameras {
namespace {

using Opened = Result<std::unique_ptr<Camera>>;

// One line a driver. A check here is for what cannot be right whatever is plugged in.
struct Open {
  CameraId id;
  const std::string& name;
  const CameraSurroundings& around;

  Error wrong(const std::string& what) const {
    return {ErrorCode::InvalidArgument, fmt::format("camera '{}': {}", name, what)};
  }

  Opened operator()(const AravisSettings& settings) const {
    const int ways = int{!settings.serial.empty()} + int{!settings.device_name.empty()} +
                     int{!settings.address.empty()} + int{!settings.mac.empty()};
    if (ways != 1)
      return wrong(fmt::format("{} of serial, device_name, address and mac are set, expected exactly one", ways));
    if (settings.clock != "estimated" && settings.clock != "utc") {
      return wrong(fmt::format("clock is '{}', expected estimated or utc", settings.clock));
    }
    if (settings.stamps != "start" && settings.stamps != "middle" && settings.stamps != "end") {
      return wrong(fmt::format("stamps is '{}', expected start, middle or end", settings.stamps));
    }
    return make_aravis_camera(id, name, settings, around.counters);
  }
  Opened operator()(const V4l2Settings& settings) const {
    if (settings.device.empty() && settings.serial.empty() && settings.bus.empty()) {
      return wrong("device is empty, expected /dev/video0 or a link under /dev/v4l; or serial, or bus");
    }
    return make_v4l2_camera(id, name, settings, around.counters);
  }
  Opened operator()(const ReplaySettings& settings) const {
    if (settings.folder.empty()) return wrong("folder is empty, expected the folder of a recording");
    return make_replay_camera(id, name, settings);
  }
  Opened operator()(const SyntheticSettings& settings) const {
    if (around.marker_set == nullptr) return wrong("a synthetic camera needs the marker set of its subject");
    const Rig none;
    const Rig& rig = around.rig != nullptr ? *around.rig : none;
    const auto model = std::find_if(rig.begin(), rig.end(), [&](const CameraModel& each) { return each.name == name; });
    if (model == rig.end())
      return wrong("a synthetic camera needs its lens and place, and the rig has no camera of this name");
    if (auto program = scene::parse_program(settings.motion); !program) return wrong(program.error().message);
    return make_synthetic_camera(id, settings, *model, *around.marker_set);
  }
};

}  // namespace

Result<std::unique_ptr<Camera>> open_camera(CameraId id, const CameraSettings& settings,
                                            const CameraSurroundings& surroundings) {
  return std::visit(Open{id, settings.name, surroundings}, settings.driver);
}

}  // namespace mocap::cameras
