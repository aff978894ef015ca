#include "ctl/shot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "detect/pixel_rows.h"

namespace mocap::ctl {

Status save_shot(const std::filesystem::path& path, const Image& image, const Blobs& blobs) try {
  if (!detect::is_whole(image)) return Error{ErrorCode::Io, "the image is not whole"};
  const std::uint32_t top = std::max(1U, detect::top_of(image.format));
  cv::Mat grey(image.height_px, image.width_px, CV_8UC1);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < image.height_px; ++y) {
    detect::read_pixels(image, y, 0, row);
    std::transform(row.begin(), row.end(), grey.ptr<std::uint8_t>(y),
                   [top](std::uint16_t level) { return static_cast<std::uint8_t>(level * 255U / top); });
  }
  cv::Mat drawn;
  cv::cvtColor(grey, drawn, cv::COLOR_GRAY2BGR);
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const cv::Point centre(static_cast<int>(std::lround(blobs[i].centroid.v.x())),
                           static_cast<int>(std::lround(blobs[i].centroid.v.y())));
    const int reach = 4 + static_cast<int>(std::sqrt(blobs[i].area_px2 / 3.14159));
    const cv::Scalar colour = blobs[i].merged ? cv::Scalar(0, 160, 255) : cv::Scalar(80, 255, 80);
    cv::rectangle(drawn, centre - cv::Point(reach, reach), centre + cv::Point(reach, reach), colour);
    cv::putText(drawn, std::to_string(i), centre + cv::Point(reach + 2, reach), cv::FONT_HERSHEY_SIMPLEX, 0.35, colour);
  }
  if (cv::imwrite(path.string(), drawn)) return {};
  return Error{ErrorCode::Io, fmt::format("{} cannot be written; expected a name that ends in .png", path.string())};
} catch (const std::exception& failure) {
  return Error{ErrorCode::Io, fmt::format("{}: {}", path.string(), failure.what())};
}

}  // namespace mocap::ctl
