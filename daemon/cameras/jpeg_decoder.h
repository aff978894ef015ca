#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"

namespace mocap::cameras {

/// Decodes the luminance of JPEG images into its own buffer (libjpeg-turbo). One thread.
class JpegDecoder {
 public:
  JpegDecoder();
  ~JpegDecoder();
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  /// Returns the grey image, width_px * height_px bytes, valid until the next call. Fails with Io if the JPEG is
  /// damaged, truncated or of another size.
  Result<std::span<const std::byte>> decode(std::span<const std::byte> jpeg, int width_px, int height_px);

 private:
  void* handle_;
  std::vector<std::byte> grey_;
};

}  // namespace mocap::cameras
