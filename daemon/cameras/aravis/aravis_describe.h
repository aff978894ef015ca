#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "cameras/aravis/aravis_settings.h"

namespace mocap::cameras {

/// One feature of a camera, as it is now.
struct FeatureValue {
  std::string category;
  std::string name;
  std::string kind;   ///< integer, float, boolean, enumeration, text, command
  std::string value;  ///< empty where it cannot be read
  std::string range;  ///< "10 to 20000", "Line0, Line1", or nothing
  bool settable = false;
};

/// Opens the camera that `settings` names, reads all that it can do and lets go of it. Takes some seconds. Fails as
/// make_aravis_camera's start() does.
Result<std::vector<FeatureValue>> describe_aravis_camera(const AravisSettings& settings);

}  // namespace mocap::cameras
