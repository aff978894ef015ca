#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "identify/calibration_pose.h"
#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"
#include "scene/clip_actor.h"
#include "scene/there_and_back.h"

namespace mocap::scene {
namespace {

// Height of the highest joint above the lowest joint of a person of 1.75 m: the head's joint is below the top of the
// head. Chosen by hand; not yet measured.
constexpr double kAssumedJointHeight_m = 1.60;
constexpr double kSoleHeight_m = 0.05;  // height of the lowest joint above the floor
constexpr double kBlend_s = 1.0;        // duration of the change from the rest pose into the motion
constexpr double kApart_m = 0.01;       // a joint nearer to its parent gets no marker

using Quaternions = std::array<Eigen::Quaterniond, kMaxBones>;

/// Joint positions in rest pose, in the file's unit and axes.
std::vector<Eigen::Vector3d> rest_places(const Bvh& bvh) {
  std::vector<Eigen::Vector3d> places;
  for (const BvhJoint& joint : bvh.joints) {
    places.push_back(joint.parent < 0 ? Eigen::Vector3d::Zero()
                                      : Eigen::Vector3d(places[static_cast<std::size_t>(joint.parent)] + joint.offset));
  }
  return places;
}

/// Rotation from the file's axes (y up) to the world's: left of the body to +y, up to +z.
Eigen::Matrix3d axes_of(const Bvh& bvh, const std::vector<Eigen::Vector3d>& places) {
  Eigen::Vector3d left = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::string_view name = known_joint(bvh.joints[i].name);
    if (name.starts_with("Left")) left += places[i];
    if (name.starts_with("Right")) left -= places[i];
  }
  const bool along_x = std::abs(left.x()) >= std::abs(left.z());
  left = along_x ? Eigen::Vector3d(left.x() < 0.0 ? -1.0 : 1.0, 0.0, 0.0)
                 : Eigen::Vector3d(0.0, 0.0, left.z() < 0.0 ? -1.0 : 1.0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  Eigen::Matrix3d ours_from_file;
  ours_from_file.row(0) = left.cross(up).transpose();
  ours_from_file.row(1) = left.transpose();
  ours_from_file.row(2) = up.transpose();
  return ours_from_file;
}

/// The file's unit in metres, such that the rest pose is as tall as a usual person.
double unit_of_m(const std::vector<Eigen::Vector3d>& places) {
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  for (const Eigen::Vector3d& place : places) {
    low = std::min(low, place.y());
    high = std::max(high, place.y());
  }
  return high > low ? kAssumedJointHeight_m / (high - low) : 0.01;
}

/// The file's skeleton, with one marker for each joint.
MarkerSet own_marker_set(const Bvh& bvh, const Eigen::Matrix3d& ours_from_file, double unit_m) {
  MarkerSet set;
  set.name = set.skeleton.name = "bvh";
  std::set<std::string, std::less<>> taken;
  for (std::size_t i = 0; i < bvh.joints.size(); ++i) {
    const BvhJoint& joint = bvh.joints[i];
    Bone bone;
    const std::string_view known = known_joint(joint.name);
    bone.name = !known.empty() && !taken.contains(known) ? std::string(known) : joint.name;
    while (!taken.insert(bone.name).second) bone.name += "'";
    bone.parent = joint.parent;
    if (joint.parent >= 0) bone.rest_offset_m = unit_m * (ours_from_file * joint.offset);
    bone.rotation_limits.fill(AngleRange{});
    if (joint.parent < 0 || bone.rest_offset_m.norm() > kApart_m) {
      set.markers.push_back({bone.name, static_cast<int>(i), Eigen::Vector3d::Zero(), {1.0F, 1.0F, 1.0F}});
    }
    set.skeleton.bones.push_back(std::move(bone));
  }
  return set;
}

class BvhActor final : public Actor {
 public:
  BvhActor(Bvh bvh, std::optional<MarkerSet> marker_set, const BvhSettings& settings)
      : bvh_(std::move(bvh)), settings_(settings) {
    const auto places = rest_places(bvh_);
    ours_from_file_ = axes_of(bvh_, places);
    unit_m_ = settings.unit_m > 0.0 ? settings.unit_m : unit_of_m(places);
    const bool own = !marker_set.has_value();
    marker_set_ = own ? own_marker_set(bvh_, ours_from_file_, unit_m_) : std::move(*marker_set);
    match_joints(places, own);
    begin_s_ = bvh_.frames > 2 ? bvh_.frame_time_s : 0.0;
    length_s_ = bvh_.frame_time_s * static_cast<double>(bvh_.frames - 1) - begin_s_;
    centre_motion();
    set_standing_pose();
  }

  bool moves() const { return joints_known_ >= 2; }
  const MarkerSet& marker_set() const override { return marker_set_; }

  void at(double t_s, ActorState& into) const override {
    const double since_s = std::max(0.0, t_s) - settings_.t_pose_s;
    Quaternions rotations;
    Eigen::Vector3d root_m = Eigen::Vector3d::Zero();
    pose_at(clip_s(std::max(0.0, since_s - kBlend_s)), root_m, rotations);
    root_m += to_middle_m_;
    if (settings_.t_pose_s > 0.0 && since_s < kBlend_s) {
      const double u = std::clamp(since_s / kBlend_s, 0.0, 1.0), share = u * u * (3.0 - 2.0 * u);
      rotations[0] = heading_.slerp(share, rotations[0]);
      for (std::size_t b = 1; b < rotations.size(); ++b) rotations[b] = standing_[b].slerp(share, rotations[b]);
      root_m.z() = share * root_m.z() + (1.0 - share) * rest_height_m_;
    }
    write_state(root_m, rotations, into);
    if (settings_.t_pose_s <= 0.0 || since_s >= kBlend_s) return;
    // A pose interpolated between two poses on the floor may be below the floor.
    const double sunk_m = kSoleHeight_m - lowest_m(into);
    if (sunk_m <= 0.0) return;
    for (Pose& pose : into.world_from_bone) pose.position.z() += sunk_m;
    for (ActorMarker& marker : into.markers) marker.position.v.z() += sunk_m;
  }

 private:
  // Computes the pose before the motion: A-pose, or T-pose if the arms cannot be lowered.
  void set_standing_pose() {
    standing_.fill(Eigen::Quaterniond::Identity());
    const auto pose = identify::make_a_pose(marker_set_, settings_.arms_lowered_rad);
    if (!pose) return;
    for (std::size_t b = 1; b < pose->rotations.size(); ++b) {
      const auto parent = static_cast<std::size_t>(marker_set_.skeleton.bones[b].parent);
      standing_[b] = pose->rotations[parent].conjugate() * pose->rotations[b];
    }
  }

  // Finds the joint of each bone, and the rotation between the limbs of both rest poses.
  void match_joints(const std::vector<Eigen::Vector3d>& places, bool own) {
    const auto& bones = marker_set_.skeleton.bones;
    MOCAP_EXPECTS(bones.size() <= kMaxBones);
    ours_from_theirs_.fill(Eigen::Quaterniond::Identity());
    for (std::size_t bone = 0; bone < bones.size(); ++bone) {
      joint_of_.push_back(own ? static_cast<int>(bone) : joint_named(bones[bone].name));
      joints_known_ += joint_of_.back() >= 0 ? 1 : 0;
    }
    for (std::size_t child = 0; !own && child < bones.size(); ++child) {
      const int parent = bones[child].parent;
      if (parent < 0) continue;
      const std::string& name = bones[static_cast<std::size_t>(parent)].name;
      const bool limb =
          name.ends_with("UpArm") || name.ends_with("LowArm") || name.ends_with("UpLeg") || name.ends_with("LowLeg");
      const int from = joint_of_[static_cast<std::size_t>(parent)], to = joint_of_[child];
      if (!limb || from < 0 || to < 0) continue;
      const Eigen::Vector3d limb_in_file =
          ours_from_file_ * (places[static_cast<std::size_t>(to)] - places[static_cast<std::size_t>(from)]);
      if (limb_in_file.norm() < 1e-6) continue;
      const auto rotation = kinematics::rotation_between(bones[child].rest_offset_m, limb_in_file);
      ours_from_theirs_[static_cast<std::size_t>(parent)] = rotation;
      ours_from_theirs_[child] = rotation;  // for hands and feet; a child that is a limb overwrites it
    }
  }

  int joint_named(const std::string& bone) const {
    const auto known = std::ranges::find_if(
        bvh_.joints, [&](const BvhJoint& joint) { return joint.name == bone || known_joint(joint.name) == bone; });
    return known == bvh_.joints.end() ? -1 : static_cast<int>(known - bvh_.joints.begin());
  }

  double clip_s(double t_s) const { return begin_s_ + there_and_back_s(t_s, length_s_); }

  // Local rotations of the bones and position of the root at an instant of the file.
  void pose_at(double file_s, Eigen::Vector3d& root_m, Quaternions& rotations) const {
    thread_local BvhPosture posture;
    thread_local std::vector<Eigen::Matrix3d> world_from_joint;
    posture_of(bvh_, file_s, posture);
    world_from_joint.resize(bvh_.joints.size());
    for (std::size_t i = 0; i < bvh_.joints.size(); ++i) {
      const Eigen::Matrix3d rotation = posture.rotations[i].toRotationMatrix();
      const int parent = bvh_.joints[i].parent;
      world_from_joint[i] =
          parent < 0 ? rotation : Eigen::Matrix3d(world_from_joint[static_cast<std::size_t>(parent)] * rotation);
    }
    root_m = unit_m_ * (ours_from_file_ * posture.root);
    const auto& bones = marker_set_.skeleton.bones;
    Quaternions world_from_bone;
    for (std::size_t i = 0; i < bones.size(); ++i) {
      const Eigen::Quaterniond parent = bones[i].parent < 0
                                            ? Eigen::Quaterniond::Identity()
                                            : world_from_bone[static_cast<std::size_t>(bones[i].parent)];
      world_from_bone[i] = parent;
      if (joint_of_[i] >= 0) {
        const Eigen::Matrix3d& theirs = world_from_joint[static_cast<std::size_t>(joint_of_[i])];
        world_from_bone[i] =
            Eigen::Quaterniond(Eigen::Matrix3d(ours_from_file_ * theirs * ours_from_file_.transpose())) *
            ours_from_theirs_[i];
      }
      rotations[i] = (parent.conjugate() * world_from_bone[i]).normalized();
    }
    for (std::size_t i = bones.size(); i < kMaxBones; ++i) rotations[i].setIdentity();
  }

  void write_state(const Eigen::Vector3d& root_m, const Quaternions& rotations, ActorState& into) const {
    const Skeleton& skeleton = marker_set_.skeleton;
    into.ghosts.clear();
    into.markers.clear();
    into.world_from_bone.resize(skeleton.bones.size());
    kinematics::compute_forward_kinematics(skeleton, root_m, std::span(rotations).first(skeleton.bones.size()),
                                           into.world_from_bone);
    for (const MarkerOnBone& marker : marker_set_.markers) {
      into.markers.push_back(
          {kinematics::marker_position(marker, into.world_from_bone[static_cast<std::size_t>(marker.bone)]), true});
    }
  }

  // Rotation about z of the direction that the hips face.
  static Eigen::Quaterniond heading_of(const Eigen::Quaterniond& hips) {
    const Eigen::Vector3d forward = hips * Eigen::Vector3d::UnitX(), left = hips * Eigen::Vector3d::UnitY();
    const double heading_rad = std::atan2(forward.y() - left.x(), forward.x() + left.y());
    return Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()));
  }

  static double lowest_m(const ActorState& state) {
    double low = std::numeric_limits<double>::max();
    for (const Pose& pose : state.world_from_bone) low = std::min(low, pose.position.z());
    return low;
  }

  // Moves the centre of the root's path to the centre of the volume, and the lowest joint of all frames to the floor.
  void centre_motion() {
    ActorState state;
    Quaternions rotations;
    rotations.fill(Eigen::Quaterniond::Identity());
    write_state(Eigen::Vector3d::Zero(), rotations, state);
    rest_height_m_ = kSoleHeight_m - lowest_m(state);
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max()), high = -low;
    for (double t_s = 0.0; t_s <= length_s_; t_s += bvh_.frame_time_s) {
      Eigen::Vector3d root_m;
      pose_at(begin_s_ + t_s, root_m, rotations);
      write_state(root_m, rotations, state);
      low = low.cwiseMin(Eigen::Vector3d(root_m.x(), root_m.y(), lowest_m(state)));
      high = high.cwiseMax(root_m);
    }
    Eigen::Vector3d at_first_m;
    pose_at(begin_s_, at_first_m, rotations);
    heading_ = heading_of(rotations[0]);
    to_middle_m_ = {-0.5 * (low.x() + high.x()), -0.5 * (low.y() + high.y()), kSoleHeight_m - low.z()};
  }

  Bvh bvh_;
  BvhSettings settings_;
  MarkerSet marker_set_;
  Eigen::Matrix3d ours_from_file_ = Eigen::Matrix3d::Identity();
  double unit_m_ = 1.0;
  std::vector<int> joint_of_;     // by bone; -1: no joint, moves with its parent
  Quaternions ours_from_theirs_;  // by bone: rotation between the limbs of both rest poses
  Quaternions standing_;          // the pose before the motion
  int joints_known_ = 0;
  double begin_s_ = 0.0, length_s_ = 0.0;
  Eigen::Vector3d to_middle_m_ = Eigen::Vector3d::Zero();
  double rest_height_m_ = 0.0;
  Eigen::Quaterniond heading_ = Eigen::Quaterniond::Identity();  // of the standing pose: that of the first frame
};

}  // namespace

Result<std::unique_ptr<Actor>> make_bvh_actor(Bvh bvh, std::optional<MarkerSet> marker_set,
                                              const BvhSettings& settings) {
  if (!marker_set && bvh.joints.size() > kMaxBones) {
    return Error{ErrorCode::InvalidArgument, "BVH: the file has " + std::to_string(bvh.joints.size()) +
                                                 " joints, expected at most " + std::to_string(kMaxBones) +
                                                 "; give a marker set, whose skeleton is then moved"};
  }
  auto actor = std::make_unique<BvhActor>(std::move(bvh), std::move(marker_set), settings);
  if (!actor->moves()) {
    return Error{ErrorCode::InvalidArgument,
                 "BVH: fewer than two joint names match a bone of the marker set; omit the marker set to use the "
                 "skeleton of the file"};
  }
  return std::unique_ptr<Actor>(std::move(actor));
}

}  // namespace mocap::scene
