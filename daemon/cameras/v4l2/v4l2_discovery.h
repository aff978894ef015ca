#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "base/result.h"
#include "cameras/v4l2/v4l2_settings.h"

namespace mocap::cameras {

/// A video node of the kernel that captures images.
struct VideoNode {
  std::filesystem::path device;  ///< /dev/video0
  std::string card;
  std::string driver;
  std::string bus;     ///< bus and port
  std::string serial;  ///< serial number of the USB device; may be empty
};

/// All nodes that this process may open, in order of their numbers.
std::vector<VideoNode> list_video_nodes();

/// The nodes of list_video_nodes() as CameraMake::discover returns cameras: device, bus, serial and model.
std::vector<KeyPairs> find_v4l2_cameras();

/// Returns the current path of the node that `device`, `serial` or `bus` identifies; numbers change when cameras are
/// plugged in again. Fails with NotFound and a list of the nodes that were found.
Result<std::filesystem::path> find_video_node(const V4l2Settings& settings);

}  // namespace mocap::cameras
