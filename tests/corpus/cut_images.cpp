#include "corpus/cut_images.h"

#include <fmt/format.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>

#include "support/places.h"

namespace mocap::corpus {
namespace {

namespace fs = std::filesystem;

constexpr int kCameras = 3, kInstants = 2;
const cv::Rect kCut(512, 400, 224, 192);
constexpr double kEdge_px = 6.0;  // a spot nearer to the edge may be cut

// As in particles_test: subtracts the background, smooths noise, and multiplies by three.
cv::Mat flattened(const cv::Mat& raw) {
  cv::Mat scene, even, flat;
  cv::medianBlur(raw, scene, 15);
  cv::GaussianBlur(raw, even, cv::Size(3, 3), 0.8);
  cv::addWeighted(even, 3.0, scene, -3.0, 0.0, flat, CV_8U);
  return flat;
}

// The spots of one instant within the cut: row, column, width, height, area and instant of each line.
std::string spots_in(const fs::path& file, int instant) {
  std::string text;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream cells(line);
    double row = 0.0, column = 0.0, width = 0.0, height = 0.0, area = 0.0, of = 0.0;
    if (!(cells >> row >> column >> width >> height >> area >> of) || static_cast<int>(of) != instant) continue;
    const double x = column - kCut.x, y = row - kCut.y;
    if (x < kEdge_px || y < kEdge_px || x > kCut.width - kEdge_px || y > kCut.height - kEdge_px) continue;
    text += fmt::format("{:.2f}\t{:.2f}\n", x, y);
  }
  return text;
}

}  // namespace

Status cut_images(const fs::path& folder) {
  const fs::path data = fs::path(support::shared_data_folder()) / "multiview/particles";
  for (int camera = 1; camera <= kCameras; ++camera) {
    for (int instant = 0; instant < kInstants; ++instant) {
      const fs::path from = data / fmt::format("cam{}/{:02}.png", camera, instant + 1);
      const cv::Mat raw = cv::imread(from.string(), cv::IMREAD_GRAYSCALE);
      if (raw.empty()) return Error{ErrorCode::NotFound, from.string() + ": cannot be read"};
      const fs::path to = folder / fmt::format("particles-cam{}-{}.png", camera, instant + 1);
      if (!cv::imwrite(to.string(), flattened(raw)(kCut))) {
        return Error{ErrorCode::Io, to.string() + ": cannot be written"};
      }
      std::ofstream(fs::path(to).replace_extension(".tsv"))
          << spots_in(data / fmt::format("blobs_cam{}.txt", camera), instant);
    }
  }
  return {};
}

}  // namespace mocap::corpus
