#pragma once

#include <memory>
#include <string>

#include "cameras/camera_make.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Makes a camera of the simulated volume in this process: its images show a subject with `marker_set` that performs
/// `settings.motion`, as `model` projects it. The image has the size of the model. The middle of the exposure of image
/// n is n periods after `settings.epoch`, at time n periods of the motion. The same settings and number give the same
/// bytes.
///
/// With a speed above 0 the camera follows the host's clock: at speed 1, image n is delivered when its exposure has
/// ended, and images that are overdue are skipped. With speed 0 every image is delivered at once, from number 0.
///
/// start() fails with InvalidArgument if the motion or a number is invalid.
std::unique_ptr<Camera> make_synthetic_camera(CameraId id, const SyntheticSettings& settings, const CameraModel& model,
                                              const MarkerSet& marker_set);

/// CameraMake::open of this make: the model is the rig's entry of the camera's name. Fails with InvalidArgument if
/// there is no such entry or no marker set.
Result<std::unique_ptr<Camera>> open_synthetic_camera(CameraId id, const std::string& name,
                                                      const SyntheticSettings& settings,
                                                      const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
