#pragma once

#include <memory>
#include <string>

#include "cameras/camera_make.h"
#include "cameras/replay/replay_settings.h"
#include "model/ids.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Makes a camera that plays a recording. `name` is the camera's name in messages and the name of its folder.
///
/// `exposed_at` and `received_at` of a frame are the recorded time, so the same recording gives the same frames at any
/// speed. With a speed above 0, next() delivers the first frame at once and each other frame at its recorded distance
/// from the first, divided by the speed, on the host's clock. Latencies against the host's clock have no meaning in a
/// replay.
///
/// Numbers that the recording lacks are gaps in Frame::number. With `loop`, numbers and times continue to increase:
/// each pass begins one mean period after the last frame. start() plays from the begin; it fails with NotFound if there
/// is no recording and with InvalidArgument if timestamps.csv is invalid. A file that cannot be read is an Io error of
/// its frame.
std::unique_ptr<Camera> make_replay_camera(CameraId id, std::string name, ReplaySettings settings);

/// CameraMake::open of this make.
Result<std::unique_ptr<Camera>> open_replay_camera(CameraId id, const std::string& name, const ReplaySettings& settings,
                                                   const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
