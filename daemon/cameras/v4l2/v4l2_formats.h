#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "model/frame.h"

namespace mocap::cameras {

/// A format of the kernel's video API: its name in the configuration, its code in the kernel, and the corresponding
/// pixel format.
struct KnownFormat {
  const char* name;
  std::uint32_t fourcc;
  PixelFormat format;
};
/// All supported formats.
std::span<const KnownFormat> known_video_formats();

/// The four characters of a format code.
std::string text_of_fourcc(std::uint32_t fourcc);

}  // namespace mocap::cameras
