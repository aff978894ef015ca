#include "lib/functional/functional_joint.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "kinematics/rotation.h"

namespace mocap::functional {
namespace {

// Standard deviations of a marker on its segment (skin) and of a joint from the middle of the two nearest markers.
// Their ratio is the weight of the latter for each frame. Chosen by hand; not yet measured.
constexpr double kSkin_m = 0.005;
constexpr double kPrior_m = 0.1;
// A joint is a hinge if it rotates by at least this range about one axis, and about the others by at most this fraction
// of it. Chosen by hand; not yet measured.
constexpr double kMinHingeRange_rad = 20.0 * std::numbers::pi / 180.0;
constexpr double kMaxOffAxisFraction = 0.25;
// Fraction of the rotations that is left out at each end of a range: exchanged labels rotate segments.
// Chosen by hand; not yet measured.
constexpr double kOutsideRange = 0.01;

struct NearestMarkers {
  std::size_t one = 0, other = 0;  // index in the segments
  double apart_m = std::numeric_limits<double>::infinity();
};

NearestMarkers nearest_markers(const bodyfit::LabelledTake& take, const SegmentMotion& one,
                               const SegmentMotion& other) {
  NearestMarkers nearest;
  for (std::size_t a = 0; a < one.markers.size(); ++a) {
    for (std::size_t b = 0; b < other.markers.size(); ++b) {
      double sum = 0.0, count = 0.0;
      for (std::size_t f = 0; f < take.frames(); ++f) {
        const double apart = (take.frame(f)[one.markers[a]] - take.frame(f)[other.markers[b]]).norm();
        if (!std::isfinite(apart)) continue;
        sum += apart;
        count += 1.0;
      }
      if (count > 0.0 && sum / count < nearest.apart_m) nearest = {a, b, sum / count};
    }
  }
  return nearest;
}

// The mean of a marker's places in the frame of another segment; zero if no frame shows both.
Eigen::Vector3d mean_in(const bodyfit::LabelledTake& take, const SegmentMotion& segment, std::size_t marker) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t f = 0; f < take.frames(); ++f) {
    const Eigen::Vector3d& place = take.frame(f)[marker];
    if (!segment.world_from_segment[f] || !place.allFinite()) continue;
    sum += segment.world_from_segment[f]->inverse() * place;
    count += 1.0;
  }
  return count > 0.0 ? Eigen::Vector3d(sum / count) : Eigen::Vector3d::Zero();
}

// The middle of the two nearest markers in the frame of `in`, which has `own` of the two.
Eigen::Vector3d middle_in(const bodyfit::LabelledTake& take, const SegmentMotion& in, std::size_t own,
                          std::size_t other_marker) {
  return 0.5 * (in.shape_m[own] + mean_in(take, in, other_marker));
}

double quantile(std::vector<double>& values, double fraction) {
  const auto at = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// The rotation vectors of `other` in `one`, by frame that shows both.
std::vector<Eigen::Vector3d> rotations_of(const SegmentMotion& one, const SegmentMotion& other) {
  std::vector<Eigen::Vector3d> rotations_rad;
  for (std::size_t f = 0; f < one.world_from_segment.size(); ++f) {
    if (!one.world_from_segment[f] || !other.world_from_segment[f]) continue;
    rotations_rad.push_back(kinematics::rotation_vector(one.world_from_segment[f]->rotation.conjugate() *
                                                        other.world_from_segment[f]->rotation));
  }
  return rotations_rad;
}

}  // namespace

std::optional<FunctionalJoint> find_joint(const bodyfit::LabelledTake& take, const SegmentMotion& one,
                                          const SegmentMotion& other) {
  const NearestMarkers nearest = nearest_markers(take, one, other);
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  double frames = 0.0;
  const auto for_each_frame = [&](const auto& use) {
    for (std::size_t f = 0; f < take.frames(); ++f) {
      if (one.world_from_segment[f] && other.world_from_segment[f])
        use(*one.world_from_segment[f], *other.world_from_segment[f]);
    }
  };
  for_each_frame([&](const Pose& a, const Pose& b) {
    Eigen::Matrix<double, 3, 6> rows;
    rows << a.rotation.toRotationMatrix(), -b.rotation.toRotationMatrix();
    normal += rows.transpose() * rows;
    right += rows.transpose() * (b.position - a.position);
    frames += 1.0;
  });
  if (frames < 3.0 || !std::isfinite(nearest.apart_m)) return std::nullopt;
  Eigen::Matrix<double, 6, 1> prior_m;
  prior_m << middle_in(take, one, nearest.one, other.markers[nearest.other]),
      middle_in(take, other, nearest.other, one.markers[nearest.one]);
  const double weight = frames * kSkin_m * kSkin_m / (kPrior_m * kPrior_m);
  normal += weight * Eigen::Matrix<double, 6, 6>::Identity();
  right += weight * prior_m;
  const Eigen::Matrix<double, 6, 1> both_m = normal.ldlt().solve(right);
  FunctionalJoint joint{both_m.head<3>(), both_m.tail<3>(), 0.0, nearest.apart_m};
  double squares_m2 = 0.0;
  for_each_frame(
      [&](const Pose& a, const Pose& b) { squares_m2 += (a * joint.in_one_m - b * joint.in_other_m).squaredNorm(); });
  joint.rms_m = std::sqrt(squares_m2 / frames);
  return joint;
}

std::optional<FunctionalJoint> find_joint_of_points(const bodyfit::LabelledTake& take, const SegmentMotion& one,
                                                    const SegmentMotion& points) {
  const NearestMarkers nearest = nearest_markers(take, one, points);
  if (!std::isfinite(nearest.apart_m)) return std::nullopt;
  const Eigen::Vector3d prior_m = middle_in(take, one, nearest.one, points.markers[nearest.other]);
  std::vector<std::vector<Eigen::Vector3d>> places_m(points.markers.size());  // in the first segment, by marker
  std::size_t frames = 0;
  for (std::size_t f = 0; f < take.frames(); ++f) {
    if (!one.world_from_segment[f]) continue;
    for (std::size_t i = 0; i < points.markers.size(); ++i) {
      const Eigen::Vector3d& place = take.frame(f)[points.markers[i]];
      if (place.allFinite()) places_m[i].push_back(one.world_from_segment[f]->inverse() * place - prior_m);
    }
    ++frames;
  }
  if (frames < 3) return std::nullopt;
  // With p relative to the prior: 2 cov(p) c = mean(p |p|^2) - mean(p) mean(|p|^2), summed over the markers.
  const double skin_m2 = kSkin_m * kSkin_m;
  Eigen::Matrix3d normal_m2 = 2.0 * skin_m2 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right_m3 = Eigen::Vector3d::Zero();
  for (const auto& of_marker : places_m) {
    if (of_marker.empty()) continue;
    const auto count = static_cast<double>(of_marker.size());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), cubic = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : of_marker) {
      mean += p / count;
      square += p * p.transpose() / count;
      cubic += p * p.squaredNorm() / count;
    }
    normal_m2 += 2.0 * (square - mean * mean.transpose());
    right_m3 += cubic - mean * square.trace();
  }
  FunctionalJoint joint;
  const Eigen::Vector3d from_prior_m = normal_m2.ldlt().solve(right_m3);
  joint.in_one_m = prior_m + from_prior_m;
  joint.apart_m = nearest.apart_m;
  double squares_m2 = 0.0, count = 0.0;
  for (const auto& of_marker : places_m) {
    double sum = 0.0, squares = 0.0;
    for (const Eigen::Vector3d& p : of_marker) {
      sum += (p - from_prior_m).norm();
      squares += (p - from_prior_m).squaredNorm();
    }
    if (of_marker.empty()) continue;
    squares_m2 += squares - sum * sum / static_cast<double>(of_marker.size());
    count += static_cast<double>(of_marker.size());
  }
  joint.rms_m = count > 0.0 ? std::sqrt(std::max(0.0, squares_m2 / count)) : 0.0;
  return joint;
}

JointRotation measure_rotation(const SegmentMotion& one, const SegmentMotion& other) {
  const std::vector<Eigen::Vector3d> rotations_rad = rotations_of(one, other);
  JointRotation measured;
  if (rotations_rad.size() < 3) return measured;
  const auto range_along = [&](const Eigen::Vector3d& axis) {
    std::vector<double> along;
    for (const Eigen::Vector3d& rotation : rotations_rad) along.push_back(axis.dot(rotation));
    const double least = quantile(along, kOutsideRange);
    return std::pair(least, quantile(along, 1.0 - kOutsideRange));
  };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& rotation : rotations_rad) mean += rotation / static_cast<double>(rotations_rad.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& rotation : rotations_rad) covariance += (rotation - mean) * (rotation - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(covariance);
  std::array<double, 3> ranges{};
  for (int axis = 0; axis < 3; ++axis) {
    std::tie(measured.least_rad[axis], measured.most_rad[axis]) = range_along(Eigen::Vector3d::Unit(axis));
    const auto [least, most] = range_along(principal.eigenvectors().col(axis));
    ranges[static_cast<std::size_t>(axis)] = most - least;
  }
  if (ranges[2] > kMinHingeRange_rad && std::max(ranges[0], ranges[1]) < kMaxOffAxisFraction * ranges[2]) {
    measured.hinge_axis = principal.eigenvectors().col(2);
    measured.hinge_range_rad = ranges[2];
  }
  return measured;
}

}  // namespace mocap::functional
