#include "pose/bone_pose_proposer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Gate on the residual of a point, in standard deviations. Chosen by hand; not yet measured.
constexpr double kGateSigmas = 4.0;
// Gate on the difference between two distances, in standard deviations. Chosen by hand; not yet measured.
constexpr double kSearchSigmas = 3.0;
// Twice the area of three points divided by their longest side. In a flatter triangle the rotation about that side is
// hardly observed. Chosen by hand; not yet measured.
constexpr double kMinTriangleHeight_m = 0.03;
// Proposals of one bone from one joint. Chosen by hand; not yet measured.
constexpr std::size_t kMaxProposals = 8;
// Volume in which the first point of a free bone may lie. Chosen by hand (a room of 2 m by 2 m by 2 m); not yet
// measured.
constexpr double kSearchVolume_m3 = 8.0;
// Fraction of all directions about a joint that its range allows: a rough half. Chosen by hand; not yet measured.
constexpr double kReachableFraction = 0.5;
constexpr double kRootTwoPi = 2.5066282746310002;

double triangle_height(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest = std::max({(a - b).norm(), (a - c).norm(), (b - c).norm()});
  return longest < 1e-9 ? 0.0 : (b - a).cross(c - a).norm() / longest;
}

// Volume that a normal distribution occupies (1 / peak density) around a point, on a sphere and on a circle.
double ball_volume(double sigma_m) { return std::pow(kRootTwoPi * sigma_m, 3); }
double shell_volume(double radius_m, double sigma_m) {
  return 4.0 * std::numbers::pi * radius_m * radius_m * kRootTwoPi * sigma_m;
}
double ring_volume(double radius_m, double sigma_m, double other_sigma_m) {
  return 2.0 * std::numbers::pi * radius_m * kRootTwoPi * kRootTwoPi * sigma_m * other_sigma_m;
}

double distance_to_line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& at) {
  const Eigen::Vector3d along = (b - a).normalized();
  return (at - a - along * along.dot(at - a)).norm();
}

}  // namespace

BonePoseProposer::BonePoseProposer() : shells_(kinematics::kMaxShapePoints) {
  proposals_.reserve(kMaxProposals + 2);
  pairs_.reserve(kinematics::kMaxShapePoints + 1);
  for (std::vector<int>& shell : shells_) shell.reserve(kMaxCloudPoints);
}

// Log odds that a clutter point lies in a volume, against a detection of the marker.
double BonePoseProposer::clutter_log_odds(double volume_m3) const {
  return std::log(settings_.clutter_density_1_m3 * volume_m3 * settings_.missed_fraction /
                  (1.0 - settings_.missed_fraction));
}

bool BonePoseProposer::is_proposed(std::size_t a, int p, std::size_t b, int q,
                                   std::span<const BoneProposal> among) const {
  return std::any_of(among.begin(), among.end(),
                     [&](const BoneProposal& one) { return one.point_of[a] == p && one.point_of[b] == q; });
}

bool BonePoseProposer::fit(const kinematics::BoneShape& shape, const JointAnchor* from, const PointCloud& cloud) {
  ++work_;
  pairs_.clear();
  const double marker = 1.0 / (settings_.marker_sigma_m * settings_.marker_sigma_m);
  if (from != nullptr) pairs_.push_back({from->joint_m, from->anchor_m, 1.0 / (from->sigma_m * from->sigma_m)});
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const int p = bone_.point_of[i];
    if (p >= 0) pairs_.push_back({shape.points[i].position_m, cloud[static_cast<std::size_t>(p)], marker});
  }
  const std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_);
  if (aligned) bone_.world_from_bone = aligned->to_from;
  return aligned.has_value();
}

// Completes and scores the proposal in bone_: fits the bone to its assigned points, assigns the nearest free point to
// each other marker, fits again and removes outliers.
void BonePoseProposer::complete_proposal(const kinematics::BoneShape& shape, const JointAnchor* from,
                                         const PointCloud& cloud, const UsedPoints& used) {
  bone_.cost = 1e9;
  if (!fit(shape, from, cloud)) return;
  const double gate = kGateSigmas * settings_.marker_sigma_m;
  const double reach = 1.5 * gate + (from == nullptr ? 0.0 : 0.5 * from->sigma_m);
  bool found_more = false;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    if (bone_.point_of[i] != -1) continue;
    const Eigen::Vector3d at = bone_.world_from_bone * shape.points[i].position_m;
    double nearest = reach * reach;
    for (std::size_t p = 0; p < cloud.size(); ++p) {
      const double off = (cloud[p] - at).squaredNorm();
      if (off >= nearest || used[p]) continue;
      if (std::find(bone_.point_of.begin(), bone_.point_of.end(), static_cast<int>(p)) != bone_.point_of.end())
        continue;
      nearest = off;
      bone_.point_of[i] = static_cast<int>(p);
      found_more = true;
    }
  }
  if (found_more && !fit(shape, from, cloud)) return;
  // Outliers are removed one at a time, the largest residual first.
  for (int rounds = 0; rounds < 3; ++rounds) {
    double worst = gate;
    std::size_t worst_point = shape.points.size();
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      const int p = bone_.point_of[i];
      if (p < 0) continue;
      const double by =
          (cloud[static_cast<std::size_t>(p)] - bone_.world_from_bone * shape.points[i].position_m).norm();
      if (by <= worst) continue;
      worst = by;
      worst_point = i;
    }
    if (worst_point == shape.points.size()) break;
    bone_.point_of[worst_point] = -1;
    if (!fit(shape, from, cloud)) return;
  }
  score(shape, from, cloud);
}

// Adds up the cost. Each further point is more significant, because clutter would have to lie in a smaller volume: on a
// shell about the joint for the first point, on a ring about the line through joint and first point for the second, in
// one place for all others.
void BonePoseProposer::score(const kinematics::BoneShape& shape, const JointAnchor* from, const PointCloud& cloud) {
  const double sigma = settings_.marker_sigma_m;
  const double joint_sigma = from == nullptr ? sigma : from->sigma_m;
  const double combined_sigma_m = std::hypot(sigma, joint_sigma);
  bone_.cost = 0.0;
  bone_.seen = 0;
  if (from != nullptr) {
    const Eigen::Vector3d off = bone_.world_from_bone * from->joint_m - from->anchor_m;
    bone_.cost += 0.5 * off.squaredNorm() / (joint_sigma * joint_sigma);
  }
  Eigen::Vector3d first = from == nullptr ? Eigen::Vector3d::Zero() : from->joint_m;
  Eigen::Vector3d second = Eigen::Vector3d::Zero();
  Eigen::Vector3d third = Eigen::Vector3d::Zero();
  int order = from == nullptr ? 0 : 1;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const int p = bone_.point_of[i];
    if (p < 0) continue;
    const Eigen::Vector3d& at = shape.points[i].position_m;
    const Eigen::Vector3d off = cloud[static_cast<std::size_t>(p)] - bone_.world_from_bone * at;
    const double radius_m = (at - first).norm();
    double volume = kSearchVolume_m3;
    if (order == 1) {
      volume = radius_m < 2.0 * combined_sigma_m ? ball_volume(combined_sigma_m)
                                                 : kReachableFraction * shell_volume(radius_m, combined_sigma_m);
    } else if (order == 2) {
      const double across = distance_to_line(first, second, at);
      const double by_joint = kReachableFraction * ring_volume(across, sigma, combined_sigma_m);
      volume = std::min(by_joint, shell_volume((at - second).norm(), std::numbers::sqrt2 * sigma));
    } else if (order == 3) {
      const double by_joint = ball_volume(sigma) * combined_sigma_m / sigma;
      volume = std::min(by_joint, ring_volume(distance_to_line(second, third, at), sigma, std::numbers::sqrt2 * sigma));
    } else if (order > 3) {
      volume = ball_volume(sigma);
    }
    volume = std::max(volume, ball_volume(sigma));
    if (order == 2) third = at;
    if (order == 0) first = at;
    if (order == 1) second = at;
    ++order;
    ++bone_.seen;
    bone_.cost += 0.5 * off.squaredNorm() / (sigma * sigma) + clutter_log_odds(volume);
  }
}

void BonePoseProposer::keep_best(std::vector<BoneProposal>& into, std::size_t max_count) const {
  if (!(bone_.cost < 1e8)) return;
  for (BoneProposal& one : into) {
    if (!std::equal(one.point_of.begin(), one.point_of.end(), bone_.point_of.begin(), bone_.point_of.end())) continue;
    if (bone_.cost < one.cost) one = bone_;
    return;
  }
  if (into.size() < max_count) {
    into.push_back(bone_);
    return;
  }
  const auto worst = std::max_element(into.begin(), into.end(),
                                      [](const BoneProposal& a, const BoneProposal& b) { return a.cost < b.cost; });
  if (bone_.cost < worst->cost) *worst = bone_;
}

void BonePoseProposer::propose_from_points(const kinematics::BoneShape& shape, const PointCloud& cloud,
                                           std::size_t first, std::size_t max_count, std::vector<BoneProposal>& into) {
  const double max_error_m = kSearchSigmas * std::numbers::sqrt2 * settings_.marker_sigma_m;
  const auto& points = shape.points;
  const UsedPoints none;
  for (std::size_t a = 0; a + 2 < points.size(); ++a) {
    for (std::size_t b = a + 1; b + 1 < points.size(); ++b) {
      const double ab = (points[a].position_m - points[b].position_m).norm();
      for (std::size_t j = 0; j < cloud.size(); ++j) {
        if (j == first || std::abs(cloud.distance(first, j) - ab) > max_error_m) continue;
        for (std::size_t c = b + 1; c < points.size(); ++c) {
          if (triangle_height(points[a].position_m, points[b].position_m, points[c].position_m) < kMinTriangleHeight_m)
            continue;
          const double ac = (points[a].position_m - points[c].position_m).norm();
          const double bc = (points[b].position_m - points[c].position_m).norm();
          for (std::size_t k = 0; k < cloud.size(); ++k) {
            if (std::abs(cloud.distance(first, k) - ac) > max_error_m ||
                std::abs(cloud.distance(j, k) - bc) > max_error_m)
              continue;
            if (k == first || k == j) continue;
            const bool is_known = std::any_of(into.begin(), into.end(), [&](const BoneProposal& one) {
              return one.point_of[a] == static_cast<int>(first) && one.point_of[b] == static_cast<int>(j) &&
                     one.point_of[c] == static_cast<int>(k);
            });
            if (is_known) continue;
            bone_.point_of.clear();
            bone_.point_of.resize(points.size());
            std::fill(bone_.point_of.begin(), bone_.point_of.end(), -1);
            bone_.point_of[a] = static_cast<int>(first);
            bone_.point_of[b] = static_cast<int>(j);
            bone_.point_of[c] = static_cast<int>(k);
            bone_.dof = Dof::Full;
            complete_proposal(shape, nullptr, cloud, none);
            if (bone_.seen >= 3) keep_best(into, max_count);
          }
        }
      }
    }
  }
}

void BonePoseProposer::propose_swing(const kinematics::BoneShape& shape, const JointAnchor& from,
                                     const PointCloud& cloud, std::size_t at, std::size_t point) {
  const Eigen::Vector3d lever = shape.points[at].position_m - from.joint_m;
  const Eigen::Vector3d seen = cloud[point] - from.anchor_m;
  if (lever.norm() < 1e-3 || seen.norm() < 1e-3) return;
  std::fill(bone_.point_of.begin(), bone_.point_of.end(), -1);
  bone_.point_of[at] = static_cast<int>(point);
  bone_.dof = Dof::Swing;
  bone_.axis = lever.normalized();
  const Eigen::Quaterniond rotation = kinematics::rotation_between(from.rest * lever, seen) * from.rest;
  // The distance error is distributed over joint and marker by their variances.
  const double joint_weight =
      from.sigma_m * from.sigma_m / (from.sigma_m * from.sigma_m + settings_.marker_sigma_m * settings_.marker_sigma_m);
  const Eigen::Vector3d joint = from.anchor_m + joint_weight * (seen - rotation * lever);
  bone_.world_from_bone = {joint - rotation * from.joint_m, rotation};
  score(shape, &from, cloud);
  keep_best(proposals_, kMaxProposals);
}

std::span<const BoneProposal> BonePoseProposer::propose_from_joint(const kinematics::BoneShape& shape,
                                                                   const JointAnchor& from, const PointCloud& cloud,
                                                                   const UsedPoints& used,
                                                                   std::span<const int> point_of_marker) {
  proposals_.clear();
  const double combined_sigma_m = std::hypot(settings_.marker_sigma_m, from.sigma_m);
  const double max_error_m = kSearchSigmas * std::numbers::sqrt2 * settings_.marker_sigma_m;
  bone_.point_of.clear();
  bone_.point_of.resize(shape.points.size());
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    shells_[i].clear();
    if (point_of_marker[static_cast<std::size_t>(shape.points[i].marker)] >= 0) continue;
    const double radius_m = (shape.points[i].position_m - from.joint_m).norm();
    for (std::size_t p = 0; p < cloud.size(); ++p) {
      if (!used[p] && std::abs((cloud[p] - from.anchor_m).norm() - radius_m) < kSearchSigmas * combined_sigma_m)
        shells_[i].push_back(static_cast<int>(p));
    }
  }
  work_ += 1 + shape.points.size() * cloud.size() / 256;
  for (std::size_t a = 0; a < shape.points.size(); ++a) {
    for (std::size_t b = a + 1; b < shape.points.size(); ++b) {
      if (shells_[a].empty() || shells_[b].empty()) continue;
      if (triangle_height(from.joint_m, shape.points[a].position_m, shape.points[b].position_m) < kMinTriangleHeight_m)
        continue;
      const double ab = (shape.points[a].position_m - shape.points[b].position_m).norm();
      for (const int p : shells_[a]) {
        for (const int q : shells_[b]) {
          if (p == q) continue;
          if (std::abs(cloud.distance(static_cast<std::size_t>(p), static_cast<std::size_t>(q)) - ab) > max_error_m)
            continue;
          if (is_proposed(a, p, b, q, proposals_)) continue;
          std::fill(bone_.point_of.begin(), bone_.point_of.end(), -1);
          for (std::size_t i = 0; i < shape.points.size(); ++i) {
            // The marker has a point of a neighbour: excluded from the search.
            if (point_of_marker[static_cast<std::size_t>(shape.points[i].marker)] >= 0) bone_.point_of[i] = -2;
          }
          bone_.point_of[a] = p;
          bone_.point_of[b] = q;
          bone_.dof = Dof::Full;
          complete_proposal(shape, &from, cloud, used);
          if (bone_.seen >= 2) keep_best(proposals_, kMaxProposals);
        }
      }
    }
  }
  for (std::size_t a = 0; a < shape.points.size(); ++a) {
    for (const int p : shells_[a]) propose_swing(shape, from, cloud, a, static_cast<std::size_t>(p));
  }
  bone_.dof = Dof::None;
  bone_.cost = 0.0;
  bone_.seen = 0;
  bone_.world_from_bone = {from.anchor_m - from.rest * from.joint_m, from.rest};
  std::fill(bone_.point_of.begin(), bone_.point_of.end(), -1);
  proposals_.push_back(bone_);
  return proposals_;
}

}  // namespace mocap::pose
