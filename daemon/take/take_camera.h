#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "model/ids.h"
#include "module/blob_camera.h"

namespace mocap::take {

struct TakeCameraSettings {
  std::filesystem::path file;  ///< the take
  double speed = 1.0;          ///< 1: recorded pace; 0: as fast as possible
  bool loop = false;
};

/// Plays the images of one camera of a take.
///
/// Numbers and times are the recorded ones, at any speed; with `loop` they continue to increase, and each pass begins
/// one mean period after the last image. start() fails with NotFound (no such file, or the take has no camera of this
/// name; the message lists its cameras) and as TakeReader::open does. A damaged image is an Io error of its frame.
std::unique_ptr<BlobCamera> make_take_camera(CameraId id, std::string name, TakeCameraSettings settings);

}  // namespace mocap::take
