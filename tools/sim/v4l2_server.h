#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"

namespace mocap::sim {

/// Writes the images of the volume's cameras to the v4l2loopback devices of `options.v4l2`, one for each camera, as
/// MJPEG or GREY, until `end` is set or `options.seconds` have passed. Images are drawn and compressed in advance. Each
/// image is written at the end of a period of the host's monotonic clock. Fails with NotFound if a device does not
/// exist, and with Unsupported if a device does not accept images.
Status serve_v4l2(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end);

}  // namespace mocap::sim
