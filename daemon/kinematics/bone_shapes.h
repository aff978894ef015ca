#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/archive.h"
#include "model/skeleton.h"

namespace mocap::kinematics {

/// At most this many markers of a bone take part in the search for its pose: the ones farthest apart.
inline constexpr std::size_t kMaxShapePoints = 8;

/// A marker in the frame of one bone.
struct ShapePoint {
  int marker = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the bone's frame
};

/// A joint that connects a bone with a neighbour.
struct ShapeJoint {
  int bone = 0;                                                    ///< the neighbour
  Eigen::Vector3d joint_in_bone_m = Eigen::Vector3d::Zero();       ///< the joint in this bone's frame
  Eigen::Vector3d joint_in_neighbour_m = Eigen::Vector3d::Zero();  ///< the joint in the neighbour's frame
};

/// The part of a body that is constant in the frame of one bone, in every pose: the markers of the bone, the markers
/// that sit in the joints of its children, and its joints.
struct BoneShape {
  std::vector<ShapePoint> points;
  std::vector<ShapeJoint> joints;
};

/// The shapes of all bones of a marker set.
class BoneShapes {
 public:
  explicit BoneShapes(const MarkerSet& set);

  /// Takes over fitted offsets. `set` equals the set of the constructor except for its offsets. Allocates nothing.
  void refit(const MarkerSet& set);

  /// Writes the offsets, or takes them over from shapes of the same marker set (see Archive).
  void archive(Archive& members);

  std::size_t size() const noexcept { return shapes_.size(); }
  const BoneShape& of(std::size_t bone) const { return shapes_[bone]; }
  /// Whether three points of the bone span a triangle that is large enough to determine the rotation of the bone.
  bool determines_rotation(std::size_t bone) const;

 private:
  std::vector<BoneShape> shapes_;  // by bone
};

}  // namespace mocap::kinematics
