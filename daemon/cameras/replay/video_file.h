#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "base/result.h"
#include "cameras/replay/grey_image.h"

namespace mocap::cameras {

/// The images of a video file, in their order. One thread.
class VideoFile {
 public:
  virtual ~VideoFile() = default;

  /// The next image as grey. Fails with EndOfStream after the last image, and with Io if the image cannot be read.
  virtual Result<GreyImage> next() = 0;
};

/// The function `mocap_open_video` of the plug-in mocap_video.so (daemon/cameras/replay/plugin/video_plugin.cpp).
/// Returns null, and the reason in `why`, if the video cannot be opened. The plug-in and its user are built together.
using OpenVideo = VideoFile*(const std::filesystem::path& video, std::string& why);

/// Opens a video with the plug-in mocap_video.so, which the first call loads. The decoders are a plug-in because they
/// depend on 200 libraries, and few daemons replay a video.
///
/// Fails with Unsupported if the plug-in is not installed or does not read the format.
Result<std::unique_ptr<VideoFile>> open_video(const std::filesystem::path& video);

}  // namespace mocap::cameras
