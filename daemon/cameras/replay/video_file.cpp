#include "cameras/replay/video_file.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "base/install_folders.h"

namespace mocap::cameras {
namespace {

struct Plugin {
  OpenVideo* open = nullptr;
  std::string fault;
};

// The plug-in stays loaded until the program ends: OpenCV's libraries do not support unloading.
const Plugin& plugin() {
  static const Plugin loaded = [] {
    const std::filesystem::path file = install_folders().plugins / "mocap_video.so";
    void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const function = library != nullptr ? dlsym(library, "mocap_open_video") : nullptr;
    if (function != nullptr) return Plugin{reinterpret_cast<OpenVideo*>(function), {}};
    const char* const why = dlerror();
    return Plugin{nullptr, fmt::format("cannot load the plug-in for videos: {}", why != nullptr ? why : file.string())};
  }();
  return loaded;
}

}  // namespace

Result<std::unique_ptr<VideoFile>> open_video(const std::filesystem::path& video) {
  std::string why = plugin().fault;
  if (plugin().open != nullptr) {
    if (VideoFile* const file = plugin().open(video, why); file != nullptr) return std::unique_ptr<VideoFile>(file);
  }
  return Error{ErrorCode::Unsupported, fmt::format("cannot open the video {}: {}", video.string(), why)};
}

}  // namespace mocap::cameras
