#pragma once

#include <memory>

#include "cameras/camera_make.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "module/camera.h"

namespace mocap::cameras {

/// A camera of the simulated volume, in this process: somebody wears `marker_set` and performs `settings.motion`, and
/// this is what `model` sees of it. The image is of the model's size; its number n is exposed (middle) n periods after
/// `settings.epoch`, when the motion has gone on for n periods. The same settings and number give the same bytes.
///
/// With speed above 0 it keeps step with the host's clock (at speed 1, number n comes when its exposure has ended) and
/// leaves out images that it is too late for, as a camera would; with speed 0 every image comes at once, from number 0.
///
/// start() fails with InvalidArgument when the motion or a number cannot be right.
std::unique_ptr<Camera> make_synthetic_camera(CameraId id, const SyntheticSettings& settings, const CameraModel& model,
                                              const MarkerSet& marker_set);

/// The same, for the list of makes: the model is the rig's entry of the camera's name. Fails with InvalidArgument if
/// there is no such entry or no marker set.
Result<std::unique_ptr<Camera>> open_synthetic_camera(CameraId id, const std::string& name,
                                                      const SyntheticSettings& settings,
                                                      const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
