#include "cameras/jpeg_decoder.h"

#include <fmt/format.h>
#include <turbojpeg.h>

namespace mocap::cameras {

JpegDecoder::JpegDecoder() : handle_(tjInitDecompress()) {}

JpegDecoder::~JpegDecoder() {
  if (handle_ != nullptr) tjDestroy(handle_);
}

Result<std::span<const std::byte>> JpegDecoder::decode(std::span<const std::byte> jpeg, int width_px, int height_px) {
  if (handle_ == nullptr) return Error{ErrorCode::Io, "the JPEG decoder could not be made: out of memory"};
  const auto* bytes = reinterpret_cast<const unsigned char*>(jpeg.data());
  const auto size = static_cast<unsigned long>(jpeg.size());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(handle_, bytes, size, &width, &height, &subsampling, &colours) != 0) {
    return Error{ErrorCode::Io, fmt::format("the JPEG is broken: {}", tjGetErrorStr2(handle_))};
  }
  if (width != width_px || height != height_px) {
    return Error{ErrorCode::Io, fmt::format("the JPEG is {}x{}, expected {}x{}", width, height, width_px, height_px)};
  }
  grey_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  // A warning (truncated data, invalid codes) means that a part of the image is plain grey: the image is rejected.
  if (tjDecompress2(handle_, bytes, size, reinterpret_cast<unsigned char*>(grey_.data()), width, width, height,
                    TJPF_GRAY, TJFLAG_FASTDCT) != 0) {
    return Error{ErrorCode::Io, fmt::format("the JPEG is broken: {}", tjGetErrorStr2(handle_))};
  }
  return std::span<const std::byte>(grey_);
}

}  // namespace mocap::cameras
