#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "export/bone_names.h"
#include "export/clip/clip.h"
#include "export/clip/in_axes.h"

namespace mocap::exports {

/// A bone in bind pose, in m and the axes of `to_y_up`. The bind pose is the T-pose: no bone is rotated.
struct SkinnedBone {
  std::string name;         ///< in the convention of the file; differs from all names of the skeleton
  std::string unique_name;  ///< differs from all bones of the clip: `Anna:Hips`, or the name if there is one subject
  int parent = -1;          ///< index of an earlier bone; -1: root
  Eigen::Vector3d offset_m =
      Eigen::Vector3d::Zero();                       ///< from the parent's joint; of the root: from the world's origin
  Eigen::Vector3d bind_m = Eigen::Vector3d::Zero();  ///< position of the joint in the world
  std::optional<Eigen::Vector3d> end_m;              ///< of a bone without children: its end, from its joint
};

/// Thin double pyramids from joint to joint, in bind pose. Each point moves with one bone. Triangles are
/// counter-clockwise seen from outside.
struct StickMesh {
  std::vector<Eigen::Vector3f> points_m;
  std::vector<Eigen::Vector3f> normals;  ///< unit vectors, by point
  std::vector<int> bones;                ///< by point
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A subject as the writers of skeleton files describe it. In bind pose the lowest joint or end is at height 0.
struct SkinnedSkeleton {
  std::string name;  ///< of the subject; differs from all subjects of the clip
  std::vector<SkinnedBone> bones;
  StickMesh mesh;
};

/// Describes one subject. `subject` is below the number of subjects; the subject has a bone.
SkinnedSkeleton skinned_skeleton(const Clip& clip, std::size_t subject, BoneNames convention);

}  // namespace mocap::exports
