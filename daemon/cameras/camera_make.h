#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/key_visitor.h"
#include "base/result.h"
#include "base/time.h"
#include "cameras/camera_settings.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "module/camera.h"
#include "module/ptp_clock.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

class NodeClocks;

/// Objects of the daemon that a camera may use beside its own settings. They outlive the camera; null if absent.
struct CameraSurroundings {
  const Rig* rig = nullptr;               ///< gives a simulated camera its lens and pose (the entry of its name)
  const MarkerSet* marker_set = nullptr;  ///< of the subject that a simulated camera sees
  StreamCounters* counters = nullptr;     ///< written by makes that count lost packets and images
  /// Exposures of one set differ by at most this time: images whose times are less certain are refused.
  Duration window = std::chrono::microseconds(500);
  NodeClocks* node_clocks = nullptr;  ///< shared by the cameras of nodes; null: a camera has a clock of its own
  const PtpClock* ptp = nullptr;      ///< of this machine, for the clocks of nodes
};

/// One feature of a camera, with its current value.
struct FeatureValue {
  std::string category;
  std::string name;
  std::string kind;   ///< integer, float, boolean, enumeration, text, command
  std::string value;  ///< empty if it cannot be read
  std::string range;  ///< "10 to 20000" or "Line0, Line1"; empty if the camera states none
  bool settable = false;
};

/// A make of cameras. The list of makes is in open_camera.cpp, one line each.
struct CameraMake {
  MakeName name;
  DriverSettings (*defaults)();
  /// Makes a camera that is not yet started; its start() opens the device. `settings.driver` is of this make and has no
  /// faults.
  Result<std::unique_ptr<Camera>> (*open)(CameraId id, const CameraSettings& settings,
                                          const CameraSurroundings& surroundings);
  /// Searches for connected cameras of this make; takes up to some seconds. Each camera is a list of properties with
  /// their values, such as {{"serial", "DA1"}, {"address", "10.0.0.2"}}: the same properties for each camera, in the
  /// order in which an operator reads them. At least one property has the name of a key that identifies the device
  /// (CameraFacts::device) and a value for that key. Null (kNotDiscoverable) if cameras of this make are found by their
  /// settings only.
  std::vector<KeyPairs> (*discover)();
  /// Opens the camera that `settings` (of this make) name, reads its features and closes it; takes some seconds. Fails
  /// as start() of such a camera does. Null if cameras of this make have no features beside their settings.
  Result<std::vector<FeatureValue>> (*describe)(const DriverSettings& settings);
  /// Settings for describe() of the camera that an operator identifies by one word, such as a serial number or an
  /// address. Null if and only if `describe` is null.
  DriverSettings (*identified_by)(const std::string& word);
};

/// The value of CameraMake::discover for a make whose cameras cannot be found without their settings.
inline constexpr std::nullptr_t kNotDiscoverable = nullptr;

/// Returns the make with settings of type S. `open(id, camera name, settings, surroundings)` makes its cameras.
/// `discover()` has no default, so that each make states whether its cameras can be discovered. `describe(settings)`
/// and `identified_by(word)` return features and settings (of type S); a make has both or neither.
template <SettingsOfAMake S, auto open, auto discover, auto describe = nullptr, auto identified_by = nullptr>
constexpr CameraMake make_with() {
  constexpr bool has_features = !std::is_null_pointer_v<std::remove_cv_t<decltype(describe)>>;
  static_assert(has_features != std::is_null_pointer_v<std::remove_cv_t<decltype(identified_by)>>);
  CameraMake make{S::kMake,
                  [] { return DriverSettings(S{}); },
                  [](CameraId id, const CameraSettings& settings,
                     const CameraSurroundings& surroundings) -> Result<std::unique_ptr<Camera>> {
                    return open(id, settings.name, *settings.driver.as<S>(), surroundings);
                  },
                  discover,
                  nullptr,
                  nullptr};
  if constexpr (has_features) {
    make.describe = [](const DriverSettings& settings) { return describe(*settings.as<S>()); };
    make.identified_by = [](const std::string& word) { return DriverSettings(identified_by(word)); };
  }
  return make;
}

/// All makes.
std::span<const CameraMake> camera_makes();

/// The make whose key `driver` has the value `driver`; null if there is none.
const CameraMake* find_make(std::string_view driver);

/// The values that the key `driver` may have.
std::vector<std::string_view> driver_words();

/// The same words as one text: "aravis, v4l2 or replay".
const std::string& driver_list();

}  // namespace mocap::cameras
