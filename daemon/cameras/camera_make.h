#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "cameras/camera_settings.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// Objects that a camera may use beside its own settings. They outlive the camera; null if there is none.
struct CameraSurroundings {
  const Rig* rig = nullptr;               ///< gives a simulated camera its lens and place (the entry of its name)
  const MarkerSet* marker_set = nullptr;  ///< of the subject that a simulated camera sees
  StreamCounters* counters = nullptr;     ///< written by makes that count lost packets and images
};

/// A make of cameras. The list of makes is in open_camera.cpp, one line each.
struct CameraMake {
  MakeName name;
  DriverSettings (*defaults)();
  /// Makes a camera that is not yet started; its start() opens the device. `settings.driver` is of this make and has no
  /// faults.
  Result<std::unique_ptr<Camera>> (*open)(CameraId id, const CameraSettings& settings,
                                          const CameraSurroundings& surroundings);
};

/// The make with settings of type S whose cameras are made by `open(id, camera name, settings, surroundings)`.
template <SettingsOfAMake S, auto open>
constexpr CameraMake make_with() {
  return {S::kMake, [] { return DriverSettings(S{}); },
          [](CameraId id, const CameraSettings& settings,
             const CameraSurroundings& surroundings) -> Result<std::unique_ptr<Camera>> {
            return open(id, settings.name, *settings.driver.as<S>(), surroundings);
          }};
}

/// All makes.
std::span<const CameraMake> camera_makes();

/// Null if there is no such make.
const CameraMake* find_make(std::string_view driver);

/// The values that the key `driver` may have.
std::vector<std::string_view> driver_words();

/// The same as a text: "aravis, v4l2 or replay".
const std::string& driver_list();

}  // namespace mocap::cameras
