#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/camera_make.h"

namespace mocap::cameras {

/// Opens the camera that `settings` identify, reads all its GenICam features and closes it. Takes some seconds. Fails
/// as start() of an Aravis camera does.
Result<std::vector<FeatureValue>> describe_aravis_camera(const AravisSettings& settings);

/// Settings of the camera that `word` identifies: an IPv4 address, a MAC (six parts separated by colons), or else a
/// serial number. The packet socket is off, so that a camera on loopback can be described too.
AravisSettings aravis_settings_for(const std::string& word);

}  // namespace mocap::cameras
