#pragma once

#include <cstddef>
#include <span>

#include "base/result.h"
#include "model/preview.h"

namespace mocap {

/// Compresses previews. The preview thread owns a PreviewEncoder and makes all calls.
class PreviewEncoder {
 public:
  virtual ~PreviewEncoder() = default;

  /// Returns the image as a JPEG, valid until the next call. Fails with Io.
  virtual Result<std::span<const std::byte>> encode(const PreviewImage& image) = 0;
};

}  // namespace mocap
