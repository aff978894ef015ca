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
/// `surroundings.window`. start() fails with NotFound while the node does not answer, and as wire::load_client_keys
/// does.
Result<std::unique_ptr<BlobCamera>> make_node_camera(CameraId id, const std::string& name,
                                                     const NodeCameraSettings& settings,
                                                     const CameraSurroundings& surroundings);

/// The same as a Camera, for the table of makes.
Result<std::unique_ptr<Camera>> open_node_camera(CameraId id, const std::string& name,
                                                 const NodeCameraSettings& settings,
                                                 const CameraSurroundings& surroundings);

}  // namespace mocap::cameras
