#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace mocap {

/// Range of a joint's rotation about one axis of its bone, rad.
struct AngleRange {
  double min_rad = -3.141592653589793;
  double max_rad = 3.141592653589793;
};

/// The names of a bone in the conventions of engines; empty if a convention has no such bone.
struct BoneAliases {
  std::string unity;   ///< HumanBodyBones
  std::string unreal;  ///< Mannequin
  std::string vrm;     ///< VRM 1.0 humanoid
};

/// A bone: a frame at its joint.
///
/// Rest pose is the T-pose with every bone's frame parallel to the world's: the subject faces +x, its left hand
/// points to +y, up is +z. A bone's rotation is relative to that pose.
struct Bone {
  std::string name;
  int parent = -1;  ///< index of an earlier bone; -1: root
  Eigen::Vector3d rest_offset_m =
      Eigen::Vector3d::Zero();  ///< from the parent's joint to the bone's joint, in rest pose
  std::array<std::optional<AngleRange>, 3> rotation_limits;  ///< about x, y, z; empty: no rotation about that axis
  BoneAliases aliases;
};

/// A tree of bones, parents before their children; the first bone is the root.
struct Skeleton {
  std::string name;
  std::vector<Bone> bones;
};

/// A marker on a bone.
struct MarkerOnBone {
  std::string name;
  int bone = 0;                                        ///< index in the skeleton
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< from the bone's joint, in the bone's frame
  std::array<float, 3> colour{1.0F, 1.0F, 1.0F};       ///< red, green, blue, 0 to 1, for drawing
};

/// Two markers of opposite bones, or of one central bone, by index in the set.
struct MarkerPair {
  std::size_t one = 0;
  std::size_t other = 0;

  bool operator==(const MarkerPair&) const = default;
};

/// The markers of a subject, and the skeleton that they are attached to.
struct MarkerSet {
  std::string name;
  Skeleton skeleton;
  std::vector<MarkerOnBone> markers;
  /// Deliberately not mirror images of each other, so that they distinguish left from right.
  std::vector<MarkerPair> asymmetric = {};
};

/// A person or prop. Its marker set starts with the offsets of the file, which are then fitted to the body.
struct Subject {
  std::string name;
  MarkerSet marker_set;
  bool fitted = false;  ///< the offsets are fitted to the body, so that the subject can be identified in any pose
};

}  // namespace mocap
