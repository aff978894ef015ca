#include "bench/detect/opencv_detector.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "detect/pixel_rows.h"

namespace mocap::bench {
namespace {

class OpencvDetector final : public Detector {
 public:
  OpencvDetector(const detect::DetectSettings& settings, int width_px, int height_px)
      : settings_(settings), width_px_(width_px), height_px_(height_px) {}

  Detection detect(const Image& image) override {
    Detection found;
    const bool fits =
        image.format == PixelFormat::Mono8 && image.width_px == width_px_ && image.height_px == height_px_;
    if (!fits || !detect::is_whole(image)) return found;
    try {
      find(image, found);
    } catch (const cv::Exception&) {
      found = {};
    }
    return found;
  }

 private:
  void find(const Image& image, Detection& found) {
    // cv::Mat has no constructor for const data. OpenCV only reads the bytes.
    const cv::Mat grey(height_px_, width_px_, CV_8UC1, const_cast<std::byte*>(image.bytes.data()), image.stride_bytes);
    cv::threshold(grey, bright_, *settings_.threshold - 1.0, 255.0, cv::THRESH_BINARY);
    cv::findContours(bright_, contours_, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    for (const auto& contour : contours_) {
      const cv::Moments moments = cv::moments(contour);
      // The contour passes through the centres of its pixels, so half of their area lies outside of it.
      const double area = moments.m00 + 0.5 * static_cast<double>(contour.size()) + 1.0;
      if (area < settings_.min_area_px2 || area > settings_.max_area_px2 || moments.m00 <= 0.0) {
        ++found.filtered;
        continue;
      }
      Blob blob;
      blob.centroid = {{moments.m10 / moments.m00, moments.m01 / moments.m00}};
      blob.area_px2 = area;
      if (!found.blobs.try_push_back(blob)) ++found.dropped;
    }
  }

  detect::DetectSettings settings_;
  int width_px_, height_px_;
  cv::Mat bright_;
  std::vector<std::vector<cv::Point>> contours_;
};

}  // namespace

Result<std::unique_ptr<Detector>> make_opencv_detector(const detect::DetectSettings& settings, PixelFormat format,
                                                       int width_px, int height_px) {
  if (format != PixelFormat::Mono8) return Error{ErrorCode::Unsupported, "detect: OpenCV's detector reads Mono8 alone"};
  if (!settings.threshold) {
    return Error{ErrorCode::InvalidArgument, "detect: OpenCV's detector has no threshold, expected 1 to 255"};
  }
  return std::unique_ptr<Detector>(std::make_unique<OpencvDetector>(settings, width_px, height_px));
}

}  // namespace mocap::bench
