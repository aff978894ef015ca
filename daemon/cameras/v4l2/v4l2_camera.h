#pragma once

#include <memory>
#include <string>

#include "cameras/camera_make.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "model/ids.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// A camera of the Linux kernel's video API, by memory-mapped streaming. `name` stands in its messages. `counters`
/// outlive the camera; null where nobody reads them.
///
/// start() negotiates format, size and rate and fails where the driver gives others; every failure names device, call
/// and reason. GREY, Y10, YUYV and NV12 frames are lent from the driver's buffer; MJPEG is decoded to Mono8.
///
/// The middle of the exposure is told by the driver's stamp where it is monotonic: half an exposure after a stamp of
/// the start of the exposure, half an exposure before a stamp of the end of the frame (the way of the bytes is in it:
/// these cameras do not tell it). Where the stamp's clock is not named (v4l2loopback), or a stamp is yet to come
/// (vivid), the time is estimated from the receipts (ClockMapping). The exposure is what the driver's control says; 0
/// where it has none.
std::unique_ptr<Camera> make_v4l2_camera(CameraId id, std::string name, V4l2Settings settings,
                                         StreamCounters* counters = nullptr);

/// The same, for the list of makes.
Result<std::unique_ptr<Camera>> open_v4l2_camera(CameraId id, const std::string& name, const V4l2Settings& settings,
                                                 const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
