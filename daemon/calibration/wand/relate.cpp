#include "calibration/wand/relate.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/median.h"
#include "geometry/epipolar.h"

namespace mocap::calibration {
namespace {

// As many are enough for a first guess, and keep the search short.
constexpr std::size_t kMostPairs = 400;
constexpr int kLeastAgreeing = 8;

struct Points {
  std::vector<cv::Point2d> a;
  std::vector<cv::Point2d> b;

  void add(const Eigen::Vector2d& in_a, const Eigen::Vector2d& in_b) {
    a.emplace_back(in_a.x(), in_a.y());
    b.emplace_back(in_b.x(), in_b.y());
  }
};

Eigen::Vector2d middle_of(const WandRays& wand, std::size_t marks) { return 0.5 * (wand.ray[0] + wand.ray[marks - 1]); }

void turn_about(WandRays& wand, std::size_t marks) {
  std::reverse(wand.ray.begin(), wand.ray.begin() + static_cast<std::ptrdiff_t>(marks));
}

std::optional<Between> turn_and_direction(const Points& points, double reach) {
  if (points.a.size() < kLeastAgreeing) return std::nullopt;
  const cv::Mat eye = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat agree;
  const cv::Mat essential = cv::findEssentialMat(points.a, points.b, eye, cv::RANSAC, 0.9999, reach, 2000, agree);
  if (essential.rows != 3 || essential.cols != 3) return std::nullopt;
  cv::Mat rotation;
  cv::Mat direction;
  if (cv::recoverPose(essential, points.a, points.b, eye, rotation, direction, agree) < kLeastAgreeing)
    return std::nullopt;
  Between b_from_a;
  cv::cv2eigen(rotation, b_from_a.rotation);
  cv::cv2eigen(direction, b_from_a.translation);
  return b_from_a;
}

double off_line(const Between& b_from_a, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Matrix3d essential = geometry::essential({}, {b_from_a.rotation, b_from_a.translation});
  return std::abs(geometry::epipolar_line(essential, {a}).distance({b}));
}

double off_lines(const Between& b_from_a, const WandRays& a, const WandRays& b, std::size_t marks) {
  double most = 0.0;
  for (std::size_t m = 0; m < marks; ++m) most = std::max(most, off_line(b_from_a, a.ray[m], b.ray[m]));
  return most;
}

Points markers_of(const std::vector<WandPair>& pairs, std::size_t marks) {
  Points points;
  for (const WandPair& pair : pairs) {
    for (std::size_t m = 0; m < marks; ++m) points.add(pair.a.ray[m], pair.b.ray[m]);
  }
  return points;
}

// A guess by the wand's middles, for which no end need be known; then each pair the way round that fits it.
void find_the_ends(std::vector<WandPair>& pairs, std::size_t marks, double reach) {
  Points points;
  for (const WandPair& pair : pairs) points.add(middle_of(pair.a, marks), middle_of(pair.b, marks));
  // What is taken for the middle is not: perspective moves it by a few hundredths of the wand's image.
  const auto guess = turn_and_direction(points, 5.0 * reach);
  if (!guess) return;
  for (WandPair& pair : pairs) {
    WandRays turned = pair.b;
    turn_about(turned, marks);
    if (off_lines(*guess, pair.a, turned, marks) < off_lines(*guess, pair.a, pair.b, marks)) pair.b = turned;
  }
}

}  // namespace

std::optional<Eigen::Vector3d> meet(const Between& b_from_a, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d u = a.homogeneous();
  const Eigen::Vector3d v = b_from_a.rotation.transpose() * b.homogeneous();
  const Eigen::Vector3d centre_b = -(b_from_a.rotation.transpose() * b_from_a.translation);
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (determinant < 1e-6 * uu * vv) return std::nullopt;
  const double along_u = (vv * u.dot(centre_b) - uv * v.dot(centre_b)) / determinant;
  const double along_v = (uv * u.dot(centre_b) - uu * v.dot(centre_b)) / determinant;
  if (along_u <= 0.0 || along_v <= 0.0) return std::nullopt;
  return 0.5 * (along_u * u + centre_b + along_v * v);
}

std::optional<Relation> relate(const std::vector<WandPair>& all, const Wand& wand, double reach) {
  const std::size_t marks = wand.marks_m.size();
  std::vector<WandPair> pairs;
  const std::size_t step = 1 + all.size() / kMostPairs;
  for (std::size_t i = 0; i < all.size(); i += step) pairs.push_back(all[i]);
  if (pairs.empty()) return std::nullopt;
  if (pairs.front().a.either_way) find_the_ends(pairs, marks, reach);
  auto b_from_a = turn_and_direction(markers_of(pairs, marks), reach);
  if (!b_from_a) return std::nullopt;

  std::vector<double> lengths;
  std::vector<double> angles;
  for (const WandPair& pair : pairs) {
    if (off_lines(*b_from_a, pair.a, pair.b, marks) > 3.0 * reach) continue;
    const auto first = meet(*b_from_a, pair.a.ray[0], pair.b.ray[0]);
    const auto last = meet(*b_from_a, pair.a.ray[marks - 1], pair.b.ray[marks - 1]);
    if (!first || !last) continue;
    lengths.push_back((*first - *last).norm());
    const Eigen::Vector3d u = pair.a.ray[0].homogeneous();
    const Eigen::Vector3d v = b_from_a->rotation.transpose() * pair.b.ray[0].homogeneous();
    angles.push_back(std::atan2(u.cross(v).norm(), u.dot(v)));
  }
  if (lengths.size() < kLeastAgreeing) return std::nullopt;
  const double length = median(lengths);
  if (!(length > 0.0)) return std::nullopt;
  b_from_a->translation *= wand.length_m() / length;
  return Relation{*b_from_a, static_cast<int>(lengths.size()),
                  static_cast<double>(lengths.size()) / static_cast<double>(pairs.size()), median(angles)};
}

}  // namespace mocap::calibration
