#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace mocap {

/// How far a joint turns about one axis of its bone, rad.
struct AngleRange {
  double min_rad = -3.141592653589793;
  double max_rad = 3.141592653589793;
};

/// The names of a bone in the schemes that engines know; empty where a scheme has none.
struct BoneAliases {
  std::string unity;   ///< HumanBodyBones
  std::string unreal;  ///< Mannequin
  std::string vrm;     ///< VRM 1.0 humanoid
};

/// A bone: the frame that sits in its joint.
///
/// Rest pose is the T-pose with every bone's frame parallel to the world's: the subject faces +x, its left hand
/// points to +y, up is +z. A bone's rotation is what turns it out of that pose.
struct Bone {
  std::string name;
  int parent = -1;                                          ///< index of a bone that stands before this one; -1: root
  Eigen::Vector3d rest_offset_m = Eigen::Vector3d::Zero();  ///< its joint from the parent's joint, in rest pose
  std::array<std::optional<AngleRange>, 3> turns;           ///< about x, y, z; empty: does not turn about that axis
  BoneAliases aliases;
};

/// A tree of bones; parents stand before their children, the first is the root.
struct Skeleton {
  std::string name;
  std::vector<Bone> bones;
};

/// A marker on a bone.
struct MarkerOnBone {
  std::string name;
  int bone = 0;                                        ///< index in the skeleton
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< from the bone's joint, in the bone's frame
  std::array<float, 3> colour{1.0F, 1.0F, 1.0F};       ///< red, green, blue, 0 to 1, for those who draw it
};

/// Two markers of opposite bones, or of one in the middle, by index in the set.
struct MarkerPair {
  std::size_t one = 0;
  std::size_t other = 0;

  bool operator==(const MarkerPair&) const = default;
};

/// The markers that a subject wears, and the skeleton they move with.
struct MarkerSet {
  std::string name;
  Skeleton skeleton;
  std::vector<MarkerOnBone> markers;
  /// On purpose no mirror images of each other: which of them is which tells left from right, however they are worn.
  std::vector<MarkerPair> asymmetric = {};
};

/// Somebody (or something) to be captured. Its marker set starts as the file's and is then fitted to the body.
struct Subject {
  std::string name;
  MarkerSet marker_set;
  bool fitted = false;  ///< the offsets are those of the body that wears it, so that it is known in any pose
};

}  // namespace mocap
