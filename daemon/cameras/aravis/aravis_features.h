#pragma once

#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "cameras/aravis/aravis_settings.h"
#include "model/frame.h"

typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name, for pointers only

namespace mocap::cameras {

/// What a camera will deliver, as it said itself after it was set.
struct AravisFeatures {
  PixelFormat format = PixelFormat::Mono8;
  Duration exposure{};  ///< zero of a camera that cannot tell
  bool software_trigger = false;
  std::optional<Duration> action_period;  ///< set: each image wants an action command, so often
};

/// Sets what `settings` asks for on an open camera that we control, and reads back whether the camera took it. Fails
/// with InvalidArgument or Unsupported naming feature, value and what the camera offers, and with Io when it does not
/// answer. Any thread that has the camera to itself; takes a round trip or two a feature.
Result<AravisFeatures> apply_settings(ArvCamera* camera, const AravisSettings& settings);

}  // namespace mocap::cameras
