#include "cameras/jpeg_encoder.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "cameras/jpeg_decoder.h"

namespace mocap::cameras {
namespace jpeg_encoder_test {

TEST(JpegEncoder, MakesAnImageThatTheDecoderReads) {
  PreviewImage image;
  image.head.image_width_px = 1280;
  image.head.image_height_px = 1024;
  image.head.step = 2;
  image.grey.resize(640 * 512);
  for (std::size_t i = 0; i < image.grey.size(); ++i) image.grey[i] = static_cast<std::uint8_t>(i % 640 / 4);
  JpegEncoder encoder;

  for (int repeat = 0; repeat < 2; ++repeat) {
    const auto jpeg = encoder.encode(image);

    ASSERT_TRUE(jpeg) << jpeg.error().message;
    JpegDecoder decoder;
    const auto grey = decoder.decode(*jpeg, 640, 512);
    ASSERT_TRUE(grey) << grey.error().message;
    for (std::size_t i = 0; i < grey->size(); ++i) {
      ASSERT_NEAR(std::to_integer<int>((*grey)[i]), image.grey[i], 12) << i;  // quality 75 of a smooth image
    }
  }
}

}  // namespace jpeg_encoder_test
}  // namespace mocap::cameras
