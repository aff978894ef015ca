#pragma once

#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "cameras/aravis/aravis_settings.h"
#include "model/frame.h"

typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name, for pointers only

namespace mocap::cameras {

/// Properties of the images that a camera delivers, as read back after the settings were applied.
struct AravisFeatures {
  PixelFormat format = PixelFormat::Mono8;
  Duration exposure{};  ///< zero if the camera does not state it
  bool software_trigger = false;
  std::optional<Duration> action_period;  ///< interval of action commands; absent without trigger = "action"
};

/// Applies `settings` to an open camera that this process controls and reads each value back. Fails with
/// InvalidArgument or Unsupported, naming feature, value and the values that the camera offers, and with Io if the
/// camera does not answer. Any thread that has exclusive use of the camera; takes one or two round trips per feature.
Result<AravisFeatures> apply_settings(ArvCamera* camera, const AravisSettings& settings);

}  // namespace mocap::cameras
