#include "lib/join/pose_offset.h"

#include <algorithm>

namespace mocap::join {
namespace {

using Numbers = google::protobuf::RepeatedField<float>;

struct BonePlace {
  Eigen::Vector3d position_m;
  Eigen::Quaterniond rotation;
};

BonePlace place_at(const Numbers& positions_m, const Numbers& rotations_xyzw, int bone) {
  const float* const p = positions_m.data() + std::ptrdiff_t{3} * bone;
  const float* const q = rotations_xyzw.data() + std::ptrdiff_t{4} * bone;
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  return {{p[0], p[1], p[2]}, rotation.norm() > 0.0 ? rotation.normalized() : Eigen::Quaterniond::Identity()};
}

BonePlace world_at(const v1::BonePoses& bones, int bone) {
  return place_at(bones.world_positions_m(), bones.world_rotations_xyzw(), bone);
}

BonePlace local_at(const v1::BonePoses& bones, int bone) {
  return place_at(bones.local_positions_m(), bones.local_rotations_xyzw(), bone);
}

void put(const BonePlace& place, int bone, Numbers& positions_m, Numbers& rotations_xyzw) {
  float* const p = positions_m.mutable_data() + std::ptrdiff_t{3} * bone;
  float* const q = rotations_xyzw.mutable_data() + std::ptrdiff_t{4} * bone;
  for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<float>(place.position_m[axis]);
  for (int axis = 0; axis < 4; ++axis) q[axis] = static_cast<float>(place.rotation.coeffs()[axis]);
}

bool has_places(const v1::BonePoses& bones, std::size_t bone_count) {
  const int count = static_cast<int>(bone_count);
  return bones.states_size() == count && bones.world_positions_m_size() == 3 * count &&
         bones.world_rotations_xyzw_size() == 4 * count && bones.local_positions_m_size() == 3 * count &&
         bones.local_rotations_xyzw_size() == 4 * count;
}

// From 1 to 0, with a speed of 0 at both ends.
double share_left(Duration since) {
  const double x = std::clamp(to_s(since) / to_s(PoseOffset::kDecay), 0.0, 1.0);
  return 1.0 - x * x * (3.0 - 2.0 * x);
}

}  // namespace

PoseOffset::PoseOffset(const v1::SubjectState& earlier, const v1::SubjectState& later, const Skeleton& skeleton) {
  const std::size_t count = skeleton.bones.size();
  if (!has_places(earlier.bones(), count) || !has_places(later.bones(), count)) return;
  bones_.resize(count);
  for (std::size_t index = 0; index < count; ++index) {
    const int b = static_cast<int>(index);
    bones_[index].parent = skeleton.bones[index].parent;
    if (earlier.bones().states(b) == v1::BONE_STATE_LOST || later.bones().states(b) == v1::BONE_STATE_LOST) continue;
    const auto place_of = [&](const v1::BonePoses& bones) {
      return bones_[index].parent < 0 ? world_at(bones, b) : local_at(bones, b);
    };
    bones_[index].position_m = place_of(earlier.bones()).position_m - place_of(later.bones()).position_m;
    bones_[index].rotation = world_at(later.bones(), b).rotation.conjugate() * world_at(earlier.bones(), b).rotation;
  }
}

void PoseOffset::add_to(v1::SubjectState& state, Duration since) const {
  const double share = share_left(since);
  if (share == 0.0 || bones_.empty() || !has_places(state.bones(), bones_.size())) return;
  v1::BonePoses& bones = *state.mutable_bones();
  std::vector<BonePlace> world(bones_.size());
  for (std::size_t index = 0; index < bones_.size(); ++index) {
    const int b = static_cast<int>(index);
    BonePlace& own = world[index] = world_at(bones, b);
    if (bones.states(b) == v1::BONE_STATE_LOST) continue;
    own.rotation = (own.rotation * Eigen::Quaterniond::Identity().slerp(share, bones_[index].rotation)).normalized();
    const int parent = bones_[index].parent;
    BonePlace local = own;
    if (parent < 0) {
      local.position_m = own.position_m += share * bones_[index].position_m;
    } else {
      const BonePlace& above = world[static_cast<std::size_t>(parent)];
      local = {local_at(bones, b).position_m + share * bones_[index].position_m,
               (above.rotation.conjugate() * own.rotation).normalized()};
      own.position_m = above.position_m + above.rotation * local.position_m;
    }
    put(own, b, *bones.mutable_world_positions_m(), *bones.mutable_world_rotations_xyzw());
    put(local, b, *bones.mutable_local_positions_m(), *bones.mutable_local_rotations_xyzw());
  }
}

}  // namespace mocap::join
