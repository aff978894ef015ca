#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "cameras/camera_make.h"
#include "cameras/tcp/tcp_settings.h"
#include "model/ids.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Makes a camera whose images another program sends over TCP. The sender listens, the daemon connects. README.md of
/// this folder defines the format.
///
/// start() connects within 300 ms, or fails with NotFound. next() fails with
/// - Timeout, if the image is not complete within `patience`; the next call continues with the bytes that have arrived,
/// - Io, if the number or the stamp of an image is invalid; the next image may be valid,
/// - DeviceLost, if the sender closed the connection, if a header is invalid (the position of the next header is then
///   unknown), or if the numbers of 8 images in a row do not increase: the connection is closed, and start() opens a
///   new one, on which the numbers may begin again.
///
/// Memory is allocated in start() and for error messages only. No received byte can make next() read or write outside
/// of that memory.
///
/// `received_at` is the time at which the last byte was read. `exposed_at` is the sender's stamp, taken as UTC or
/// converted by ClockMapping, as the key `clock` selects; never later than `received_at`. A stamp of UTC that is more
/// than 1 ms later than its arrival, or 10 s before it, is invalid.
Result<std::unique_ptr<Camera>> open_tcp_camera(CameraId id, const std::string& name, const TcpSettings& settings,
                                                const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
