#include "bench/fuse/fuse_reference.h"

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "geometry/epipolar.h"

namespace mocap::bench {
namespace {

constexpr double kNearLine_px = 2.0;

struct Camera {
  cv::Matx33d matrix;
  cv::Vec<double, 5> distortion;
  cv::Mat projection;  // 3x4, to undistorted pixels
  cv::Matx33d fundamental_to_next;
  std::vector<cv::Point2d> seen, undistorted;
};

template <int Rows, int Columns, class M>
cv::Matx<double, Rows, Columns> to_cv(const M& from) {
  cv::Matx<double, Rows, Columns> to;
  for (int row = 0; row < Rows; ++row) {
    for (int column = 0; column < Columns; ++column) to(row, column) = from(row, column);
  }
  return to;
}

}  // namespace

struct FuseReference::Parts {
  std::vector<Camera> cameras;
  std::vector<cv::Vec3d> lines;
  std::vector<cv::Point2d> from, to;
  cv::Mat homogeneous;
  std::vector<WorldPoint> points;

  void meet(Camera& a, Camera& b);
};

FuseReference::FuseReference(const Rig& rig) : parts_(std::make_unique<Parts>()) {
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const CameraModel& model = rig[i];
    Camera camera;
    camera.matrix = {model.lens.fx_px, 0.0, model.lens.cx_px, 0.0, model.lens.fy_px, model.lens.cy_px, 0.0, 0.0, 1.0};
    camera.distortion = cv::Vec<double, 5>(model.lens.distortion.data());
    Eigen::Matrix<double, 3, 4> from_world;
    from_world << model.camera_from_world.rotation, model.camera_from_world.translation;
    camera.projection = cv::Mat(camera.matrix * to_cv<3, 4>(from_world));
    camera.fundamental_to_next = to_cv<3, 3>(geometry::fundamental(model, rig[(i + 1) % rig.size()]));
    parts_->cameras.push_back(camera);
  }
}

FuseReference::~FuseReference() = default;

std::span<const WorldPoint> FuseReference::step(std::span<const std::unique_ptr<BlobFrame>> frames) {
  parts_->points.clear();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Camera& camera = parts_->cameras[i];
    camera.seen.clear();
    camera.undistorted.clear();
    for (const Blob& blob : frames[i]->blobs) camera.seen.emplace_back(blob.centroid.v.x(), blob.centroid.v.y());
    if (camera.seen.empty()) continue;
    cv::undistortPoints(camera.seen, camera.undistorted, camera.matrix, camera.distortion, cv::noArray(),
                        camera.matrix);
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    parts_->meet(parts_->cameras[i], parts_->cameras[(i + 1) % frames.size()]);
  }
  return parts_->points;
}

void FuseReference::Parts::meet(Camera& a, Camera& b) {
  if (a.undistorted.empty() || b.undistorted.empty()) return;
  cv::computeCorrespondEpilines(a.undistorted, 1, a.fundamental_to_next, lines);
  from.clear();
  to.clear();
  for (std::size_t i = 0; i < a.undistorted.size(); ++i) {
    const cv::Vec3d& line = lines[i];
    double least = kNearLine_px;
    const cv::Point2d* nearest = nullptr;
    for (const cv::Point2d& point : b.undistorted) {
      const double off = std::abs(line[0] * point.x + line[1] * point.y + line[2]);
      if (off >= least) continue;
      least = off;
      nearest = &point;
    }
    if (nearest == nullptr) continue;
    from.push_back(a.undistorted[i]);
    to.push_back(*nearest);
  }
  if (from.empty()) return;
  cv::triangulatePoints(a.projection, b.projection, from, to, homogeneous);
  for (int i = 0; i < homogeneous.cols; ++i) {
    const double w = homogeneous.at<double>(3, i);
    points.push_back(
        {Eigen::Vector3d(homogeneous.at<double>(0, i), homogeneous.at<double>(1, i), homogeneous.at<double>(2, i)) /
         w});
  }
}

}  // namespace mocap::bench
