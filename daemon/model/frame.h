#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/time.h"
#include "model/ids.h"

namespace mocap {

/// Layout of the bytes of an image.
enum class PixelFormat {
  Mono8,
  Mono10,        ///< 16-bit little endian, the low 10 bits used
  Mono12,        ///< 16-bit little endian, the low 12 bits used
  Mono10p,       ///< GenICam PFNC packing: 4 pixels in 5 bytes, least significant bit first
  Mono12p,       ///< GenICam PFNC packing: 2 pixels in 3 bytes, least significant bit first
  Mono10Packed,  ///< GigE Vision packing: 2 pixels in 3 bytes; high 8 bits, low bits of both, high 8 bits
  Mono12Packed,  ///< the same with 12 bits
  BayerGr8,      ///< one byte a site; the first row begins with green, red
  BayerRg8,
  BayerGb8,
  BayerBg8,
  Yuyv,   ///< luminance is every second byte, from the first
  Nv12,   ///< luminance plane first
  Mjpeg,  ///< `bytes` is one JPEG; stride has no meaning
};

/// Pixels, borrowed from the camera that received them.
struct Image {
  std::span<const std::byte> bytes;
  /// Bytes from one row to the next. If a packed format's stride is no longer than its row, pixels continue from row to
  /// row without any gap.
  std::size_t stride_bytes = 0;
  int width_px = 0;
  int height_px = 0;
  PixelFormat format = PixelFormat::Mono8;
};

/// One image of one camera. The pixels are borrowed from the camera until its next call.
struct Frame {
  CameraId camera;
  std::uint64_t number = 0;  ///< the camera's own count of exposures: a gap is a lost image
  Timestamp exposed_at;      ///< middle of the exposure
  Timestamp received_at;     ///< arrival of the last byte
  Image image;
};

}  // namespace mocap
