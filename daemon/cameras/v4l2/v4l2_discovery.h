#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "cameras/v4l2/v4l2_settings.h"

namespace mocap::cameras {

/// A video node of the kernel that captures images.
struct VideoNode {
  std::filesystem::path device;  ///< /dev/video0
  std::string card;
  std::string driver;
  std::string bus;     ///< where it is plugged in
  std::string serial;  ///< of the USB device; empty where there is none
};

/// All that can be opened, by number.
std::vector<VideoNode> list_video_nodes();

/// The node that `device`, `serial` or `bus` names, as it is called now: numbers change when cameras are plugged in
/// anew. Fails with NotFound, and what was found instead.
Result<std::filesystem::path> find_video_node(const V4l2Settings& settings);

}  // namespace mocap::cameras
