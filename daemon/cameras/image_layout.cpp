#include "cameras/image_layout.h"

namespace mocap::cameras {

std::size_t packed_stride_bytes(PixelFormat format, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  switch (format) {
    case PixelFormat::Mono8:
    case PixelFormat::BayerGr8:
    case PixelFormat::BayerRg8:
    case PixelFormat::BayerGb8:
    case PixelFormat::BayerBg8:
    case PixelFormat::Nv12: return width;
    case PixelFormat::Mono10:
    case PixelFormat::Mono12:
    case PixelFormat::Yuyv: return width * 2;
    case PixelFormat::Mono10p: return (width * 10 + 7) / 8;
    case PixelFormat::Mono10Packed:
    case PixelFormat::Mono12Packed:
    case PixelFormat::Mono12p: return (width * 12 + 7) / 8;
    case PixelFormat::Mjpeg: return 0;
  }
  return 0;
}

std::size_t luminance_bytes(PixelFormat format, std::size_t stride_bytes, int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (format == PixelFormat::Mono10p) return (pixels * 10 + 7) / 8;
  const bool twelve_bits =
      format == PixelFormat::Mono12p || format == PixelFormat::Mono10Packed || format == PixelFormat::Mono12Packed;
  if (twelve_bits) return (pixels * 12 + 7) / 8;
  if (height_px <= 0) return 0;
  // The last row may lack the padding at its end.
  return stride_bytes * static_cast<std::size_t>(height_px - 1) + packed_stride_bytes(format, width_px);
}

}  // namespace mocap::cameras
