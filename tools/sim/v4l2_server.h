#pragma once

#include <atomic>

#include "base/result.h"
#include "options.h"
#include "scene/volume.h"

namespace mocap::sim {

/// Shows the volume's cameras on devices of v4l2loopback, `options.v4l2` one by one, as MJPEG or GREY, until `end` is
/// set or `options.seconds` have passed. Images are drawn and compressed beforehand; each is written when a period of
/// the host's clock ends.
///
/// Fails with NotFound where a device is not there, and with Unsupported where it takes no images.
Status serve_v4l2(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end);

}  // namespace mocap::sim
