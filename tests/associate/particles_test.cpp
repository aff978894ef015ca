// Hundreds of equal particles recorded by a real rig of three cameras: from pixels to 3D points, compared with the
// results of another program.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "detect/blob_detector.h"
#include "support/places.h"

namespace mocap::associate {
namespace particles_test {

const std::string kFolder = support::shared_data_folder() + "/multiview/particles/";
constexpr int kCameras = 3;
constexpr int kWidth_px = 1280;
constexpr int kHeight_px = 1024;

std::vector<std::vector<double>> read_table(const std::string& file) {
  std::ifstream stream(kFolder + file);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream cells(line);
    std::vector<double> row;
    for (double cell = 0.0; cells >> cell;) row.push_back(cell);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

struct Fitted {
  CameraModel camera;
  double rms_px = 0.0;
};

/// Fits a pinhole camera with k1, p1 and p2 to the calibration points of one camera: image x, y; world x, y, z in mm.
Fitted fit_camera(int number) {
  std::vector<cv::Point3f> world;
  std::vector<cv::Point2f> image;
  for (const auto& row : read_table("cam" + std::to_string(number) + "_cal_points.txt")) {
    image.emplace_back(static_cast<float>(row[0]), static_cast<float>(row[1]));
    world.emplace_back(static_cast<float>(row[2]) / 1000.0F, static_cast<float>(row[3]) / 1000.0F,
                       static_cast<float>(row[4]) / 1000.0F);
  }
  cv::Mat matrix = (cv::Mat_<double>(3, 3) << 6000.0, 0.0, 640.0, 0.0, 6000.0, 512.0, 0.0, 0.0, 1.0);
  cv::Mat distortion = cv::Mat::zeros(5, 1, CV_64F);
  std::vector<cv::Mat> turns, shifts;
  Fitted fitted;
  fitted.rms_px =
      cv::calibrateCamera(std::vector<std::vector<cv::Point3f>>{world}, std::vector<std::vector<cv::Point2f>>{image},
                          cv::Size(kWidth_px, kHeight_px), matrix, distortion, turns, shifts,
                          cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3);
  CameraModel& camera = fitted.camera;
  camera.name = "cam" + std::to_string(number);
  camera.width_px = kWidth_px;
  camera.height_px = kHeight_px;
  camera.lens.fx_px = matrix.at<double>(0, 0);
  camera.lens.fy_px = matrix.at<double>(1, 1);
  camera.lens.cx_px = matrix.at<double>(0, 2);
  camera.lens.cy_px = matrix.at<double>(1, 2);
  for (int i = 0; i < 5; ++i) camera.lens.distortion[i] = distortion.at<double>(i);
  cv::Mat rotation;
  cv::Rodrigues(turns[0], rotation);
  for (int row = 0; row < 3; ++row) {
    camera.camera_from_world.translation[row] = shifts[0].at<double>(row);
    for (int column = 0; column < 3; ++column) {
      camera.camera_from_world.rotation(row, column) = rotation.at<double>(row, column);
    }
  }
  return fitted;
}

/// Subtracts the unevenly lit background, as the other program did, smooths pixel noise, and multiplies by three to use
/// more grey levels. The particles have 2 to 10 px and a brightness of 4 to 15 times the noise.
cv::Mat flattened(const cv::Mat& raw) {
  cv::Mat scene, even, flat;
  cv::medianBlur(raw, scene, 15);
  cv::GaussianBlur(raw, even, cv::Size(3, 3), 0.8);
  cv::addWeighted(even, 3.0, scene, -3.0, 0.0, flat, CV_8U);
  return flat;
}

/// The blobs of one camera at one instant.
BlobFrame see(int number, int instant) {
  const cv::Mat pixels = flattened(cv::imread(
      kFolder + "cam" + std::to_string(number) + "/0" + std::to_string(instant) + ".png", cv::IMREAD_GRAYSCALE));
  EXPECT_EQ(pixels.cols, kWidth_px);
  detect::DetectSettings settings;
  settings.threshold = 20.0;  // about three times the remaining noise
  settings.low_threshold = 10.0;
  settings.min_area_px2 = 3.0;
  settings.grow_px = 1;
  auto detector = detect::make_blob_detector(settings, PixelFormat::Mono8, kWidth_px, kHeight_px);
  EXPECT_TRUE(detector);
  Image image;
  image.format = PixelFormat::Mono8;
  image.width_px = pixels.cols;
  image.height_px = pixels.rows;
  image.stride_bytes = pixels.step;
  image.bytes = std::as_bytes(std::span(pixels.data, pixels.step * static_cast<std::size_t>(pixels.rows)));
  BlobFrame frame;
  frame.camera = CameraId{static_cast<std::uint32_t>(number - 1)};
  frame.blobs = (*detector)->detect(image).blobs;
  return frame;
}

/// The number of `wanted` points that have a point of `found` within half a millimetre, and their rms distance.
std::pair<int, double> compare(const std::vector<Eigen::Vector3d>& wanted, const Markers& found) {
  int near = 0;
  double squares_mm2 = 0.0;
  for (const Eigen::Vector3d& peer : wanted) {
    double least_mm = 1e9;
    for (const Marker& marker : found) least_mm = std::min(least_mm, 1000.0 * (marker.position.v - peer).norm());
    if (least_mm > 0.5) continue;
    ++near;
    squares_mm2 += least_mm * least_mm;
  }
  return {near, near > 0 ? std::sqrt(squares_mm2 / near) : 0.0};
}

TEST(Particles, AreFoundWhereAnotherProgramFoundThemWithARealRig) {
  const auto peers = read_table("particles.peer.txt");
  if (peers.empty()) GTEST_SKIP() << "no images of particles at " << kFolder;
  Rig rig;
  for (int number = 1; number <= kCameras; ++number) {
    const Fitted fitted = fit_camera(number);
    EXPECT_LT(fitted.rms_px, 0.8) << "camera " << number;
    rig.push_back(fitted.camera);
  }
  MatchSettings match;
  match.volume_min_m = {-0.02, -0.02, -0.05};
  match.volume_max_m = {0.10, 0.10, 0.05};
  const auto matcher = make_matcher(match, rig);
  const auto triangulator = make_triangulator({}, rig);

  int wanted = 0;
  int near = 0;
  for (int instant = 1; instant <= 2; ++instant) {
    std::vector<std::unique_ptr<BlobFrame>> frames;
    FrameSet set;
    set.expected_views = kCameras;
    for (int number = 1; number <= kCameras; ++number) {
      set.views.push_back(frames.emplace_back(std::make_unique<BlobFrame>(see(number, instant))).get());
    }
    std::vector<Eigen::Vector3d> peer;
    for (const auto& row : peers) {
      if (static_cast<int>(row[7]) == instant - 1) peer.emplace_back(row[0] / 1000.0, row[1] / 1000.0, row[2] / 1000.0);
    }
    const Markers& found = triangulator->triangulate(set, matcher->match(set, {}));
    const auto [count, rms_mm] = compare(peer, found);
    EXPECT_LT(rms_mm, 0.25);
    wanted += static_cast<int>(peer.size());
    near += count;
    // Control: if the points are shifted by half the distance of the particles, few are found by chance.
    for (Eigen::Vector3d& place : peer) place += Eigen::Vector3d(0.003, 0.003, 0.003);
    EXPECT_LE(compare(peer, found).first, 2);
  }
  RecordProperty("wanted", wanted);
  RecordProperty("near", near);
  EXPECT_GE(near, 0.9 * wanted);
}

}  // namespace particles_test
}  // namespace mocap::associate
