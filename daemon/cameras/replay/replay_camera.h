#pragma once

#include <memory>
#include <string>

#include "cameras/camera_make.h"
#include "cameras/replay/replay_settings.h"
#include "model/ids.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Plays what a camera recorded. `name` is the camera's: in messages, and of its folder.
///
/// A frame's `exposed_at` is always the recorded time, and so is its `received_at`: the same recording gives the same
/// frames at any pace. At a pace (speed over 0) next() gives a frame not before it is due: the first at once, the
/// others at the recorded distance from it, divided by the speed, by the host's clock. So latencies against the host's
/// clock have no meaning in a replay.
///
/// Numbers that the recording leaves out are gaps in Frame::number. Looped, numbers and times go on growing: each turn
/// begins one mean period after the last frame. start() begins anew, fails with NotFound where nothing is recorded and
/// with InvalidArgument where timestamps.csv is wrong. A file that cannot be read is an Io error of its frame.
std::unique_ptr<Camera> make_replay_camera(CameraId id, std::string name, ReplaySettings settings);

/// The same, for the list of makes.
Result<std::unique_ptr<Camera>> open_replay_camera(CameraId id, const std::string& name, const ReplaySettings& settings,
                                                   const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
