#pragma once

#include <memory>
#include <span>

#include "module/preview_encoder.h"

namespace mocap::cameras {

/// Compresses grey images (libjpeg-turbo).
class JpegEncoder final : public PreviewEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder() override;
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  Result<std::span<const std::byte>> encode(const PreviewImage& image) override;

 private:
  void* handle_;
  unsigned char* jpeg_ = nullptr;  // allocated and grown by the library
  unsigned long size_ = 0;
};

}  // namespace mocap::cameras
