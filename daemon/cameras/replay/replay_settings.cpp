#include "cameras/replay/replay_settings.h"

#include <fmt/format.h>

#include <system_error>

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, ReplaySettings& camera) {
  keys.path("folder", camera.folder,
            {.help = "the camera's folder, or the folder that contains it under the camera's name; it holds images "
                     "000000.pgm or .png, or one video, and timestamps.csv",
             .example = ".",
             .example_is_active = true,
             .must_exist = true});
  keys.path("file", camera.file,
            {.help = "instead of folder: a take, which has the blobs of the camera of this name",
             .example = "takes/take_001.mcap",
             .must_exist = true});
  keys.number("rate_hz", camera.rate_hz, {0.1, 10000}, {.help = "images per second if there is no timestamps.csv"});
  keys.number("speed", camera.speed, {0, 1000},
              {.help = "1: recorded pace; 2: twice the recorded pace; 0: as fast as possible"});
  keys.flag("loop", camera.loop, {.help = "true: begin again at the end"});
}

std::vector<KeyFault> faults_of(const ReplaySettings& camera) {
  if (camera.folder.empty() == camera.file.empty()) {
    return {{"folder", fmt::format("folder is '{}' and file is '{}', expected one of both: the folder of this camera's "
                                   "images, or a take",
                                   camera.folder.string(), camera.file.string())}};
  }
  return {};
}

CameraFacts facts_of(const ReplaySettings& camera, const std::string& camera_name) {
  CameraFacts facts{.rate_hz = camera.rate_hz, .recorded_time = true};
  if (!camera.file.empty()) return facts;  // the cameras of a take share it
  // Cameras may share a folder that contains one folder for each of them.
  std::error_code ignored;
  if (!std::filesystem::is_directory(camera.folder / camera_name, ignored)) {
    facts.device = {{"folder", camera.folder.string()}};
  }
  return facts;
}

}  // namespace mocap::cameras
