#include "cameras/jpeg_decoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace mocap::cameras {
namespace jpeg_decoder_test {

// A bright disc on a dark gradient, in colour as from a webcam.
cv::Mat picture() {
  cv::Mat grey(48, 64, CV_8UC3);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool disc = std::hypot(x - 30, y - 20) < 8.0;
      const auto value = static_cast<unsigned char>(disc ? 240 : 20 + x);
      grey.at<cv::Vec3b>(y, x) = {value, value, value};
    }
  }
  return grey;
}

std::vector<unsigned char> jpeg_of(const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
  return bytes;
}

TEST(JpegDecoder, GivesTheLuminanceOfAColourImage) {
  const cv::Mat image = picture();
  const std::vector<unsigned char> bytes = jpeg_of(image);
  JpegDecoder decoder;

  const auto grey = decoder.decode(std::as_bytes(std::span(bytes)), 64, 48);

  ASSERT_TRUE(grey) << grey.error().message;
  ASSERT_EQ(grey->size(), 64U * 48U);
  double sum_of_squares = 0.0;
  for (std::size_t i = 0; i < grey->size(); ++i) {
    const int x = static_cast<int>(i % 64), y = static_cast<int>(i / 64);
    sum_of_squares += std::pow(static_cast<double>((*grey)[i]) - image.at<cv::Vec3b>(y, x)[0], 2);
  }
  EXPECT_LT(std::sqrt(sum_of_squares / (64.0 * 48.0)), 4.0);  // grey levels; loss of quality 95 at the edge of the disc
}

TEST(JpegDecoder, RefusesATruncatedJpeg) {
  std::vector<unsigned char> bytes = jpeg_of(picture());
  bytes.resize(bytes.size() / 2);
  JpegDecoder decoder;

  const auto grey = decoder.decode(std::as_bytes(std::span(bytes)), 64, 48);

  EXPECT_EQ(grey.error().code, ErrorCode::Io);
}

TEST(JpegDecoder, RefusesAnotherSizeAndOtherData) {
  const std::vector<unsigned char> bytes = jpeg_of(picture());
  const std::vector<unsigned char> rubbish(500, 0x5A);
  JpegDecoder decoder;

  EXPECT_EQ(decoder.decode(std::as_bytes(std::span(bytes)), 640, 480).error().message,
            "the JPEG is 64x48, expected 640x480");
  EXPECT_EQ(decoder.decode(std::as_bytes(std::span(rubbish)), 64, 48).error().code, ErrorCode::Io);
  EXPECT_EQ(decoder.decode({}, 64, 48).error().code, ErrorCode::Io);
}

}  // namespace jpeg_decoder_test
}  // namespace mocap::cameras
