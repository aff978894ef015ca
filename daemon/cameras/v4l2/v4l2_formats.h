#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "model/frame.h"

namespace mocap::cameras {

/// A format of the kernel's video API: as the configuration calls it, as the kernel does, and how we read it.
struct KnownFormat {
  const char* name;
  std::uint32_t fourcc;
  PixelFormat format;
};
/// All formats that we read.
std::span<const KnownFormat> known_video_formats();

/// The four letters of a format.
std::string text_of_fourcc(std::uint32_t fourcc);

}  // namespace mocap::cameras
