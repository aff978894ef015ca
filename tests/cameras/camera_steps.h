#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <optional>

#include "base/time.h"
#include "model/frame.h"
#include "module/camera.h"

namespace mocap::cameras {

/// The next complete frame within `patience`. Broken frames are skipped.
inline std::optional<Frame> whole_frame(Camera& camera, Duration patience = std::chrono::seconds(5)) {
  const Timestamp end = host_now() + patience;
  while (host_now() < end) {
    Result<Frame> frame = camera.next(std::chrono::milliseconds(100));
    if (frame) return *frame;
    if (frame.error().code != ErrorCode::Timeout && frame.error().code != ErrorCode::Io) return std::nullopt;
  }
  return std::nullopt;
}

/// Starts a camera as the daemon does: repeats start() while the search continues.
inline Status started(Camera& camera) {
  Status begun = camera.start();
  for (int i = 0; i < 50 && !begun && begun.error().code == ErrorCode::Timeout; ++i) begun = camera.start();
  return begun;
}

/// Number of entries of a folder, such as /proc/self/fd with the open files of this process.
inline std::size_t entries(const char* folder) {
  using Iterator = std::filesystem::directory_iterator;
  return static_cast<std::size_t>(std::distance(Iterator(folder), Iterator()));
}

}  // namespace mocap::cameras
