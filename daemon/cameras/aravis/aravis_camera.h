#pragma once

#include <memory>
#include <string>

#include "cameras/aravis/aravis_settings.h"
#include "cameras/camera_make.h"
#include "model/ids.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// Makes a GigE Vision or USB3 Vision camera that uses Aravis. `name` is the camera's name in messages. `counters`
/// outlive the camera; null if they are not needed.
///
/// start() opens the device, applies the settings and reads them back, on a separate thread. start() waits 300 ms for
/// the result and then fails with Timeout; the next start() waits for the same attempt (a search takes about 1 s).
/// start() fails with NotFound and a list of the cameras that were found, with Busy if another program controls the
/// camera, and with InvalidArgument naming feature, value and range. The pixels of next() are in the stream's own
/// buffer. If the camera does not answer for about 5 s, next() fails with DeviceLost, and start() opens the camera
/// again; a camera that answers but sends no image is the caller's concern. stop() and the destructor take 250 ms each
/// at most.
///
/// AravisSettings::clock selects how the middle of the exposure is converted to the host's clock.
std::unique_ptr<Camera> make_aravis_camera(CameraId id, std::string name, AravisSettings settings,
                                           StreamCounters* counters = nullptr);

/// CameraMake::open of this make.
Result<std::unique_ptr<Camera>> open_aravis_camera(CameraId id, const std::string& name, const AravisSettings& settings,
                                                   const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
