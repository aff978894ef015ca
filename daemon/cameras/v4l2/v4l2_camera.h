#pragma once

#include <memory>
#include <string>

#include "cameras/camera_make.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "model/ids.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// Makes a camera of the Linux kernel's video API, with memory-mapped buffers. `name` is the camera's name in messages.
/// `counters` outlive the camera; null if they are not needed.
///
/// start() sets format, size and rate, and fails if the driver selects others; each failure names device, call and
/// reason. GREY, Y10, Y12, Bayer, YUYV and NV12 pixels are in the driver's buffer; MJPEG is decoded to Mono8.
///
/// The middle of the exposure is computed from the driver's stamp if its clock is the monotonic one: half an exposure
/// after a stamp of the start of the exposure, or half an exposure before a stamp of the end of the frame (which
/// contains the unknown transfer time). If the clock is not stated (v4l2loopback), or a stamp is in the future (vivid),
/// ClockMapping estimates the time from the times of receipt. The exposure is the value of the driver's control, 0 if
/// there is none.
std::unique_ptr<Camera> make_v4l2_camera(CameraId id, std::string name, V4l2Settings settings,
                                         StreamCounters* counters = nullptr);

/// CameraMake::open of this make.
Result<std::unique_ptr<Camera>> open_v4l2_camera(CameraId id, const std::string& name, const V4l2Settings& settings,
                                                 const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
