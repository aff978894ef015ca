#pragma once

#include <memory>
#include <string>

#include "cameras/aravis/aravis_settings.h"
#include "cameras/camera_make.h"
#include "model/ids.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// A GigE Vision or USB3 Vision camera, by Aravis. `name` stands in its messages. `counters` outlive the camera; null
/// where nobody reads them.
///
/// start() opens the device, sets what the settings ask for and checks that the camera took it, all on a thread aside.
/// It waits 300 ms for that; then it fails with Timeout, and the next start() takes up the same answer (looking around
/// takes a second). It fails with NotFound and what was found instead, Busy when another program controls the camera,
/// InvalidArgument naming feature, value and range. next() lends the stream's own buffer. When the camera stops
/// answering, next() fails with DeviceLost (after some 5 s without an answer; silence is the caller's to notice), and
/// start() opens it anew. stop() and the end take 250 ms each at most.
///
/// The middle of the exposure is told on the host's clock as AravisSettings::clock says.
std::unique_ptr<Camera> make_aravis_camera(CameraId id, std::string name, AravisSettings settings,
                                           StreamCounters* counters = nullptr);

/// The same, for the list of makes.
Result<std::unique_ptr<Camera>> open_aravis_camera(CameraId id, const std::string& name, const AravisSettings& settings,
                                                   const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
