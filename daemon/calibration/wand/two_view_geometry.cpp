#include "calibration/wand/two_view_geometry.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/robust_statistics.h"
#include "geometry/epipolar.h"

namespace mocap::calibration {
namespace {

// Enough for an initial guess; more would only lengthen the search. Chosen by hand; not yet measured.
constexpr std::size_t kMaxPairs = 400;
// Three more than the five points of a minimal sample: fewer inliers agree by chance.
constexpr int kMinInliers = 8;

struct Points {
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;

  void add(const Eigen::Vector2d& in_a, const Eigen::Vector2d& in_b) {
    a.emplace_back(in_a.x(), in_a.y());
    b.emplace_back(in_b.x(), in_b.y());
  }
};

Eigen::Vector2d middle_of(const WandRays& wand, std::size_t markers) {
  return 0.5 * (wand.ray[0] + wand.ray[markers - 1]);
}

void reverse(WandRays& wand, std::size_t markers) {
  std::reverse(wand.ray.begin(), wand.ray.begin() + static_cast<std::ptrdiff_t>(markers));
}

// Relative pose with a baseline of length 1.
std::optional<CameraFromCamera> rotation_and_baseline(const Points& points, double max_distance) {
  if (points.a.size() < kMinInliers) return std::nullopt;
  const cv::Mat eye = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat inliers;
  const cv::Mat essential =
      cv::findEssentialMat(points.a, points.b, eye, cv::RANSAC, 0.9999, max_distance, 2000, inliers);
  if (essential.rows != 3 || essential.cols != 3) return std::nullopt;
  cv::Mat rotation;
  cv::Mat direction;
  if (cv::recoverPose(essential, points.a, points.b, eye, rotation, direction, inliers) < kMinInliers)
    return std::nullopt;
  CameraFromCamera b_from_a;
  cv::cv2eigen(rotation, b_from_a.rotation);
  cv::cv2eigen(direction, b_from_a.translation);
  return b_from_a;
}

double epipolar_distance(const CameraFromCamera& b_from_a, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Matrix3d essential = geometry::essential({}, {b_from_a.rotation, b_from_a.translation});
  return std::abs(geometry::epipolar_line(essential, {a}).distance({b}));
}

double largest_epipolar_distance(const CameraFromCamera& b_from_a, const WandRays& a, const WandRays& b,
                                 std::size_t markers) {
  double most = 0.0;
  for (std::size_t m = 0; m < markers; ++m) most = std::max(most, epipolar_distance(b_from_a, a.ray[m], b.ray[m]));
  return most;
}

Points markers_of(const std::vector<WandCorrespondence>& pairs, std::size_t markers) {
  Points points;
  for (const WandCorrespondence& pair : pairs) {
    for (std::size_t m = 0; m < markers; ++m) points.add(pair.a.ray[m], pair.b.ray[m]);
  }
  return points;
}

// Resolves the order of the ends of a symmetric wand: a first pose from the midpoints, which need no order, then for
// each correspondence the order that fits this pose better.
void order_ends(std::vector<WandCorrespondence>& pairs, std::size_t markers, double max_distance) {
  Points points;
  for (const WandCorrespondence& pair : pairs) points.add(middle_of(pair.a, markers), middle_of(pair.b, markers));
  // The midpoint in the image is not the image of the midpoint: perspective moves it by some hundredths of the wand's
  // image length. Hence the wider tolerance.
  const auto guess = rotation_and_baseline(points, 5.0 * max_distance);
  if (!guess) return;
  for (WandCorrespondence& pair : pairs) {
    WandRays reversed = pair.b;
    reverse(reversed, markers);
    if (largest_epipolar_distance(*guess, pair.a, reversed, markers) <
        largest_epipolar_distance(*guess, pair.a, pair.b, markers))
      pair.b = reversed;
  }
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate_midpoint(const CameraFromCamera& b_from_a, const Eigen::Vector2d& a,
                                                    const Eigen::Vector2d& b) {
  const Eigen::Vector3d u = a.homogeneous();
  const Eigen::Vector3d v = b_from_a.rotation.transpose() * b.homogeneous();
  const Eigen::Vector3d centre_b = -(b_from_a.rotation.transpose() * b_from_a.translation);
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (determinant < 1e-6 * uu * vv) return std::nullopt;  // an angle below 1 mrad
  const double along_u = (vv * u.dot(centre_b) - uv * v.dot(centre_b)) / determinant;
  const double along_v = (uv * u.dot(centre_b) - uu * v.dot(centre_b)) / determinant;
  if (along_u <= 0.0 || along_v <= 0.0) return std::nullopt;
  return 0.5 * (along_u * u + centre_b + along_v * v);
}

std::optional<TwoViewGeometry> estimate_two_view_geometry(const std::vector<WandCorrespondence>& correspondences,
                                                          const Wand& wand, double max_distance) {
  const std::size_t markers = wand.marks_m.size();
  std::vector<WandCorrespondence> pairs;
  const std::size_t step = 1 + correspondences.size() / kMaxPairs;
  for (std::size_t i = 0; i < correspondences.size(); i += step) pairs.push_back(correspondences[i]);
  if (pairs.empty()) return std::nullopt;
  if (pairs.front().a.ends_unknown) order_ends(pairs, markers, max_distance);
  auto b_from_a = rotation_and_baseline(markers_of(pairs, markers), max_distance);
  if (!b_from_a) return std::nullopt;

  std::vector<double> lengths;
  std::vector<double> angles;
  for (const WandCorrespondence& pair : pairs) {
    if (largest_epipolar_distance(*b_from_a, pair.a, pair.b, markers) > 3.0 * max_distance) continue;
    const auto first = triangulate_midpoint(*b_from_a, pair.a.ray[0], pair.b.ray[0]);
    const auto last = triangulate_midpoint(*b_from_a, pair.a.ray[markers - 1], pair.b.ray[markers - 1]);
    if (!first || !last) continue;
    lengths.push_back((*first - *last).norm());
    const Eigen::Vector3d u = pair.a.ray[0].homogeneous();
    const Eigen::Vector3d v = b_from_a->rotation.transpose() * pair.b.ray[0].homogeneous();
    angles.push_back(std::atan2(u.cross(v).norm(), u.dot(v)));
  }
  if (lengths.size() < kMinInliers) return std::nullopt;
  const double length = median(lengths);
  if (!(length > 0.0)) return std::nullopt;
  b_from_a->translation *= wand.length_m() / length;
  return TwoViewGeometry{*b_from_a, static_cast<int>(lengths.size()),
                         static_cast<double>(lengths.size()) / static_cast<double>(pairs.size()), median(angles)};
}

}  // namespace mocap::calibration
