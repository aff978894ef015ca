#include "identify/rigid_finder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/expects.h"

namespace mocap::identify {
namespace {

double doubled_area_m2(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b - a).cross(c - a).norm();
}

}  // namespace

RigidFinder::RigidFinder(const MarkerSet& set, double tolerance_m) : tolerance_m_(tolerance_m) {
  MOCAP_EXPECTS(set.markers.size() <= kMaxLabels);
  for (const MarkerOnBone& marker : set.markers) model_.push_back(marker.offset_m);
  pairs_.reserve(model_.size());
  candidate_.point_of_marker.resize(model_.size());
  for (const Bone& bone : set.skeleton.bones) candidate_.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : set.markers) candidate_.marker_offsets_m.push_back(marker.offset_m);
  choose_triple();
}

// Three markers on one line do not determine the rotation about the line.
void RigidFinder::choose_triple() {
  if (model_.size() <= 3) return;
  const Eigen::Vector3d &a = model_[0], &b = model_[1], &c = model_[2];
  const double longest_m = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
  double largest_m2 = doubled_area_m2(a, b, c);
  if (largest_m2 > tolerance_m_ * longest_m) return;  // the height of the triangle exceeds the tolerance
  for (std::size_t i = 0; i < model_.size(); ++i) {
    for (std::size_t j = i + 1; j < model_.size(); ++j) {
      for (std::size_t k = j + 1; k < model_.size(); ++k) {
        const double area_m2 = doubled_area_m2(model_[i], model_[j], model_[k]);
        if (!(area_m2 > largest_m2)) continue;
        largest_m2 = area_m2;
        triple_ = {i, j, k};
      }
    }
  }
}

bool RigidFinder::distance_matches(std::size_t a, std::size_t b, const Eigen::Vector3d& p,
                                   const Eigen::Vector3d& q) const {
  const double distance_m = (model_[a] - model_[b]).norm();
  return std::abs((p - q).norm() - distance_m) < 2.0 * tolerance_m_;
}

void RigidFinder::evaluate_triple(std::span<const Eigen::Vector3d> points, std::size_t i, std::size_t j,
                                  std::size_t k) {
  pairs_.clear();
  for (const auto& [marker, point] : {std::pair{triple_[0], i}, std::pair{triple_[1], j}, std::pair{triple_[2], k}}) {
    pairs_.push_back({model_[marker], points[point]});
  }
  std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_);
  if (!aligned) return;
  pairs_.clear();
  for (std::size_t m = 0; m < model_.size(); ++m) {
    const Eigen::Vector3d at = aligned->to_from * model_[m];
    double nearest = 3.0 * tolerance_m_;
    candidate_.point_of_marker[m] = -1;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const double off = (points[p] - at).norm();
      if (off >= nearest) continue;
      nearest = off;
      candidate_.point_of_marker[m] = static_cast<int>(p);
    }
    const int p = candidate_.point_of_marker[m];
    if (p >= 0) pairs_.push_back({model_[m], points[static_cast<std::size_t>(p)]});
  }
  const std::size_t needed = model_.size() - (model_.size() >= 5 ? 1 : 0);
  aligned = geometry::fit_rigid(pairs_);
  if (pairs_.size() < needed || !aligned || aligned->rms_m > tolerance_m_) return;
  candidate_.rms_m = aligned->rms_m;
  candidate_.matched = static_cast<int>(pairs_.size());
  if (found_) {
    const bool same =
        std::equal(found_->point_of_marker.begin(), found_->point_of_marker.end(), candidate_.point_of_marker.begin());
    // An assignment is worse if its rms is 1.5 times as large or more, better if half as large or less, plus 1 mm each.
    // Between both, the assignments are ambiguous.
    if (!same && candidate_.rms_m > 1.5 * found_->rms_m + 0.001) return;
    ambiguous_ = ambiguous_ && !(candidate_.rms_m < 0.5 * found_->rms_m - 0.001);
    if (!same && candidate_.rms_m > 0.5 * found_->rms_m - 0.001) ambiguous_ = true;
    if (candidate_.rms_m > found_->rms_m) return;
  }
  found_ = candidate_;
}

const std::optional<FoundBody>& RigidFinder::find(std::span<const Eigen::Vector3d> points) {
  found_.reset();
  ambiguous_ = false;
  if (model_.size() < 3) return found_;
  const auto [first, second, third] = triple_;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (i == j || !distance_matches(first, second, points[i], points[j])) continue;
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (k == i || k == j || !distance_matches(first, third, points[i], points[k]) ||
            !distance_matches(second, third, points[j], points[k]))
          continue;
        evaluate_triple(points, i, j, k);
      }
    }
  }
  if (ambiguous_) found_.reset();
  return found_;
}

}  // namespace mocap::identify
