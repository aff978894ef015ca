#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "cameras/camera_make.h"
#include "cameras/tcp/tcp_settings.h"
#include "model/ids.h"
#include "module/camera.h"

namespace mocap::cameras {

/// A camera whose images another program sends over TCP. The sender listens, the daemon connects. README.md of this
/// folder defines the format.
///
/// start() connects, for at most 300 ms, and fails with NotFound if nobody listens. next() fails with
/// - Timeout, if the image is not complete within `patience`; the next call continues with the bytes that have come,
/// - Io, if the number or the stamp of an image cannot be right; the next image may be whole,
/// - DeviceLost, if the sender closed the connection, or if a header cannot be right: then the place of the next header
///   is unknown, the connection is closed, and start() opens a new one.
/// Memory is allocated in start() and for messages of errors. No value of any byte that arrives can make next() read or
/// write outside of that memory.
///
/// `received_at` is the time at which the last byte was read. `exposed_at` is the sender's stamp, taken as UTC or
/// converted by ClockMapping, as the key `clock` says.
Result<std::unique_ptr<Camera>> open_tcp_camera(CameraId id, const std::string& name, const TcpSettings& settings,
                                                const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
