#include "cameras/jpeg_encoder.h"

#include <turbojpeg.h>

#include <string>

#include "base/expects.h"

namespace mocap::cameras {
namespace {

// 20 kB for 640x512 px of a dark image with noise, and blobs without visible rings.
constexpr int kQuality = 75;

}  // namespace

JpegEncoder::JpegEncoder() : handle_(tjInitCompress()) {}

JpegEncoder::~JpegEncoder() {
  tjFree(jpeg_);
  if (handle_ != nullptr) tjDestroy(handle_);
}

Result<std::span<const std::byte>> JpegEncoder::encode(const PreviewImage& image) {
  if (handle_ == nullptr) return Error{ErrorCode::Io, "the JPEG encoder could not be made: out of memory"};
  const int width = image.head.width_px(), height = image.head.height_px();
  MOCAP_EXPECTS(image.grey.size() >= static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (tjCompress2(handle_, image.grey.data(), width, width, height, TJPF_GRAY, &jpeg_, &size_, TJSAMP_GRAY, kQuality,
                  TJFLAG_FASTDCT) != 0) {
    return Error{ErrorCode::Io, std::string("the preview cannot be compressed: ") + tjGetErrorStr2(handle_)};
  }
  return std::span(reinterpret_cast<const std::byte*>(jpeg_), size_);
}

}  // namespace mocap::cameras
