#include "export/skinned_skeleton.h"

#include <algorithm>
#include <utility>

#include "base/expects.h"

namespace mocap::exports {
namespace {

// A shorter stick has no direction; a bone shorter than this is drawn to its end.
constexpr double kMinStick_m = 1e-3;

// Length of the end of a bone without children and without markers. Drawing only.
constexpr double kDefaultEnd_m = 0.1;

// Shape of a stick: its widest section as a fraction of its length, and the radius there. Drawing only.
constexpr double kWaist = 0.2;
constexpr double kRadius = 0.05;

// The end of a bone without children: its marker farthest from the joint; without such a marker, the bone continues the
// direction from its parent; a root points up. World axes.
Eigen::Vector3d end_of(const MarkerSet& set, std::size_t bone) {
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  for (const MarkerOnBone& marker : set.markers) {
    if (marker.bone == static_cast<int>(bone) && marker.offset_m.norm() > end.norm()) {
      end = marker.offset_m;
    }
  }
  if (end.norm() >= kMinStick_m) {
    return end;
  }
  const Bone& its = set.skeleton.bones[bone];
  const bool has_direction = its.parent >= 0 && its.rest_offset_m.norm() >= kMinStick_m;
  return kDefaultEnd_m * (has_direction ? its.rest_offset_m.normalized() : Eigen::Vector3d::UnitZ());
}

std::vector<SkinnedBone> bones_of(const MarkerSet& set, BoneNames convention) {
  const std::vector<Bone>& bones = set.skeleton.bones;
  const std::vector<std::string> names = bone_names(set.skeleton, convention);
  std::vector<bool> is_leaf(bones.size(), true);
  std::vector<SkinnedBone> skinned;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    SkinnedBone bone{.name = names[b], .unique_name = {}, .parent = bones[b].parent, .end_m = {}};
    if (bone.parent >= 0) {
      const auto parent = static_cast<std::size_t>(bone.parent);
      is_leaf[parent] = false;
      bone.offset_m = to_y_up(bones[b].rest_offset_m);
      bone.bind_m = skinned[parent].bind_m + bone.offset_m;
    }
    skinned.push_back(std::move(bone));
  }
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (is_leaf[b]) {
      skinned[b].end_m = to_y_up(end_of(set, b));
    }
  }
  return skinned;
}

// Moves the bind pose vertically until its lowest joint or end is at height 0.
void put_on_floor(std::vector<SkinnedBone>& bones) {
  double lowest_m = 0.0;
  for (const SkinnedBone& bone : bones) {
    lowest_m = std::min(lowest_m, bone.bind_m.y() + (bone.end_m ? std::min(0.0, bone.end_m->y()) : 0.0));
  }
  for (SkinnedBone& bone : bones) {
    bone.bind_m.y() -= lowest_m;
    if (bone.parent < 0) {
      bone.offset_m.y() -= lowest_m;
    }
  }
}

// Adds a double pyramid from a joint along `along`: the point at the joint, four points around the waist, the point at
// the end.
void add_stick(StickMesh& mesh, int bone, const Eigen::Vector3d& joint_m, const Eigen::Vector3d& along_m) {
  const auto first = static_cast<std::uint32_t>(mesh.points_m.size());
  const Eigen::Vector3d along = along_m.normalized();
  const Eigen::Vector3d side = along.unitOrthogonal();
  const Eigen::Vector3d other = along.cross(side);
  const auto add = [&](const Eigen::Vector3d& point_m, const Eigen::Vector3d& normal) {
    mesh.points_m.emplace_back(point_m.cast<float>());
    mesh.normals.emplace_back(normal.cast<float>());
    mesh.bones.push_back(bone);
  };
  add(joint_m, -along);
  for (const Eigen::Vector3d& radial : {side, other, Eigen::Vector3d(-side), Eigen::Vector3d(-other)}) {
    add(joint_m + kWaist * along_m + kRadius * along_m.norm() * radial, radial);
  }
  add(joint_m + along_m, along);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t one = first + 1 + i;
    const std::uint32_t next = first + 1 + (i + 1) % 4;
    mesh.triangles.push_back({first, next, one});
    mesh.triangles.push_back({first + 5, one, next});
  }
}

StickMesh mesh_of(const std::vector<SkinnedBone>& bones) {
  StickMesh mesh;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const SkinnedBone& bone = bones[b];
    if (bone.end_m) {
      add_stick(mesh, static_cast<int>(b), bone.bind_m, *bone.end_m);
    }
    if (bone.parent >= 0 && bone.offset_m.norm() >= kMinStick_m) {
      add_stick(mesh, bone.parent, bones[static_cast<std::size_t>(bone.parent)].bind_m, bone.offset_m);
    }
  }
  return mesh;
}

std::vector<std::string> subject_names(const Clip& clip) {
  std::vector<std::string> names;
  for (const ClipSubject& subject : clip.subjects) {
    names.push_back(subject.subject.name.empty() ? "Subject" : subject.subject.name);
  }
  return made_unique(std::move(names));
}

}  // namespace

SkinnedSkeleton skinned_skeleton(const Clip& clip, std::size_t subject, BoneNames convention) {
  MOCAP_EXPECTS(subject < clip.subjects.size());
  const MarkerSet& set = clip.subjects[subject].subject.marker_set;
  MOCAP_EXPECTS(!set.skeleton.bones.empty());
  SkinnedSkeleton skinned{.name = subject_names(clip)[subject], .bones = bones_of(set, convention), .mesh = {}};
  for (SkinnedBone& bone : skinned.bones) {
    bone.unique_name = clip.subjects.size() > 1 ? skinned.name + ":" + bone.name : bone.name;
  }
  put_on_floor(skinned.bones);
  skinned.mesh = mesh_of(skinned.bones);
  return skinned;
}

}  // namespace mocap::exports
