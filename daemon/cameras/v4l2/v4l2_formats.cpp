#include "cameras/v4l2/v4l2_formats.h"

#include <linux/videodev2.h>

namespace mocap::cameras {
namespace {

constexpr KnownFormat kFormats[] = {
    {"GREY", V4L2_PIX_FMT_GREY, PixelFormat::Mono8},      {"Y10", V4L2_PIX_FMT_Y10, PixelFormat::Mono10},
    {"Y12", V4L2_PIX_FMT_Y12, PixelFormat::Mono12},       {"GRBG", V4L2_PIX_FMT_SGRBG8, PixelFormat::BayerGr8},
    {"RGGB", V4L2_PIX_FMT_SRGGB8, PixelFormat::BayerRg8}, {"GBRG", V4L2_PIX_FMT_SGBRG8, PixelFormat::BayerGb8},
    {"BA81", V4L2_PIX_FMT_SBGGR8, PixelFormat::BayerBg8}, {"YUYV", V4L2_PIX_FMT_YUYV, PixelFormat::Yuyv},
    {"NV12", V4L2_PIX_FMT_NV12, PixelFormat::Nv12},       {"MJPEG", V4L2_PIX_FMT_MJPEG, PixelFormat::Mjpeg}};

}  // namespace

std::span<const KnownFormat> known_video_formats() { return kFormats; }

std::string text_of_fourcc(std::uint32_t fourcc) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>((fourcc >> shift) & 0x7F);
  return text;
}

}  // namespace mocap::cameras
