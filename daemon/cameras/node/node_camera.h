#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "cameras/camera_make.h"
#include "cameras/node/node_settings.h"
#include "module/blob_camera.h"

namespace mocap::cameras {

/// A camera of a node: its blobs arrive with their 2D tracks. Times are mapped to the host's clock (PeerClock); ids of
/// 2D tracks go on increasing after a restart of the node. Images are refused while the clock is less certain than
/// `surroundings.window`. start() fails with
/// - NotFound, while the node does not answer, refuses, has no images of the camera, or its clock is too uncertain,
/// - Timeout, if the node answered within the last 2 s and does not now: the next start() goes on waiting,
/// - InvalidArgument, if the node plays a recording and the settings say otherwise, or the reverse,
/// - Io, if a message of the node is malformed,
/// and as wire::load_client_keys and wire::NodeLink::open do. next() fails with DeviceLost after 2 s without an echo;
/// of a recording it waits without end, with one line in the log.
Result<std::unique_ptr<BlobCamera>> make_node_camera(CameraId id, const std::string& name,
                                                     const NodeCameraSettings& settings,
                                                     const CameraSurroundings& surroundings);

/// The same as a Camera, for the table of makes.
Result<std::unique_ptr<Camera>> open_node_camera(CameraId id, const std::string& name,
                                                 const NodeCameraSettings& settings,
                                                 const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
