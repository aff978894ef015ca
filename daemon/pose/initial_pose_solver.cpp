#include "pose/initial_pose_solver.h"

#include <algorithm>
#include <optional>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Weight of a joint position that a neighbour predicts, relative to a marker. Chosen by hand; not yet measured.
constexpr double kJointWeight = 0.2;
// Points nearer to a common line leave the rotation about the line unobserved: the distance is below the scatter of
// markers on the skin. Chosen by hand; not yet measured.
constexpr double kMinOffLine_m = 0.02;

// The largest distance of a point from the line through the first point and the point farthest from it.
double distance_off_line(std::span<const geometry::PointPair> pairs) {
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  for (const auto& pair : pairs) {
    const Eigen::Vector3d lever = pair.from - pairs[0].from;
    if (lever.norm() > along.norm()) along = lever;
  }
  if (along.norm() < 1e-6) return 0.0;
  along.normalize();
  double max_distance_m = 0.0;
  for (const auto& pair : pairs) {
    const Eigen::Vector3d lever = pair.from - pairs[0].from;
    max_distance_m = std::max(max_distance_m, (lever - along * along.dot(lever)).norm());
  }
  return max_distance_m;
}

}  // namespace

InitialPoseSolver::InitialPoseSolver(const MarkerSet& set) : shapes_(set) {
  const std::size_t bones = set.skeleton.bones.size();
  attachments_.resize(bones);
  for (std::size_t root = 0; root < bones; ++root) {
    std::vector<bool> visited(bones);
    std::vector<std::size_t> ends{root};
    visited[root] = true;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      for (const kinematics::ShapeJoint& joint : shapes_.of(ends[i]).joints) {
        const auto bone = static_cast<std::size_t>(joint.bone);
        if (visited[bone]) continue;
        visited[bone] = true;
        attachments_[root].push_back({bone, ends[i]});
        ends.push_back(bone);
      }
    }
  }
  seen_.resize(set.markers.size());
  bones_.resize(bones);
  pairs_.reserve(set.markers.size() + 1);
}

void InitialPoseSolver::gather(std::size_t bone) {
  for (const kinematics::ShapePoint& point : shapes_.of(bone).points) {
    const kinematics::Observation* one = seen_[static_cast<std::size_t>(point.marker)];
    if (one != nullptr) pairs_.push_back({point.position_m, one->position, 1.0});
  }
}

bool InitialPoseSolver::begin(std::size_t root) {
  pairs_.clear();
  gather(root);
  if (pairs_.size() < 3 || distance_off_line(pairs_) < kMinOffLine_m) return false;
  const std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_);
  if (!aligned) return false;
  bones_[root].world = aligned->to_from;
  bones_[root].dof = Dof::Full;
  return true;
}

void InitialPoseSolver::attach(const MarkerSet& set, const Attachment& next) {
  BonePoseHypothesis& bone = bones_[next.bone];
  const BonePoseHypothesis& from = bones_[next.from];
  const bool is_child = set.skeleton.bones[next.bone].parent == static_cast<int>(next.from);
  const Eigen::Vector3d offset = set.skeleton.bones[is_child ? next.bone : next.from].rest_offset_m;
  const Eigen::Vector3d joint_in_bone_m = is_child ? Eigen::Vector3d::Zero() : offset;
  const Eigen::Vector3d joint = from.world * (is_child ? offset : Eigen::Vector3d::Zero());
  pairs_.clear();
  pairs_.push_back({joint_in_bone_m, joint, kJointWeight});
  gather(next.bone);
  const Eigen::Quaterniond& rest = from.world.rotation;
  bone = {{joint - rest * joint_in_bone_m, rest}, Dof::None, Eigen::Vector3d::Zero(), joint_in_bone_m, 0.0};
  if (pairs_.size() >= 3 && distance_off_line(pairs_) > kMinOffLine_m) {
    if (const std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_)) {
      bone.world = aligned->to_from;
      bone.dof = Dof::Full;
      return;
    }
  }
  // The point farthest from the joint determines the swing.
  const auto furthest = std::max_element(pairs_.begin(), pairs_.end(), [&](const auto& a, const auto& b) {
    return (a.from - joint_in_bone_m).norm() < (b.from - joint_in_bone_m).norm();
  });
  const Eigen::Vector3d lever = furthest->from - joint_in_bone_m;
  const Eigen::Vector3d to = furthest->to - joint;
  if (lever.norm() < kMinOffLine_m || to.norm() < kMinOffLine_m) return;
  const Eigen::Quaterniond rotation = kinematics::rotation_between(rest * lever, to) * rest;
  bone.world = {joint - rotation * joint_in_bone_m, rotation};
  bone.dof = Dof::Swing;
  bone.axis = lever.normalized();
}

bool InitialPoseSolver::solve(const MarkerSet& set, std::span<const kinematics::Observation> seen,
                              std::span<Pose> locals) {
  shapes_.refit(set);
  std::fill(seen_.begin(), seen_.end(), nullptr);
  for (const kinematics::Observation& one : seen) {
    if (!one.bearing_only && one.position.allFinite()) seen_[static_cast<std::size_t>(one.marker)] = &one;
  }
  std::size_t root = bones_.size();
  std::size_t max_count = 2;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    pairs_.clear();
    gather(b);
    if (pairs_.size() <= max_count || distance_off_line(pairs_) < kMinOffLine_m) continue;
    max_count = pairs_.size();
    root = b;
  }
  if (root == bones_.size() || !begin(root)) return false;
  for (const Attachment& next : attachments_[root]) attach(set, next);
  resolve_twist(set.skeleton, bones_);
  to_local_poses(set.skeleton, bones_, locals);
  return true;
}

}  // namespace mocap::pose
