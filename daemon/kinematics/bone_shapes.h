#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/skeleton.h"

namespace mocap::kinematics {

/// More markers of one bone do not take part in laying it on points: the widest apart do.
inline constexpr std::size_t kMaxShapePoints = 8;

/// A marker as one bone sees it.
struct ShapePoint {
  int marker = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the bone's frame
};

/// Where a bone hangs together with a neighbour.
struct ShapeJoint {
  int bone = 0;                                                    ///< the neighbour
  Eigen::Vector3d joint_in_bone_m = Eigen::Vector3d::Zero();       ///< the joint in this bone's frame
  Eigen::Vector3d joint_in_neighbour_m = Eigen::Vector3d::Zero();  ///< the same in the neighbour's
};

/// What does not change in a bone's frame, whatever the pose: its markers, the markers that sit in the joints of the
/// bones below it, and its joints.
struct BoneShape {
  std::vector<ShapePoint> points;
  std::vector<ShapeJoint> joints;
};

/// The shapes of all bones of a marker set.
class BoneShapes {
 public:
  explicit BoneShapes(const MarkerSet& set);

  /// New places after a fit; `set` is the one of the constructor but for its offsets. Allocates nothing.
  void refit(const MarkerSet& set);

  std::size_t size() const noexcept { return shapes_.size(); }
  const BoneShape& of(std::size_t bone) const { return shapes_[bone]; }
  /// Whether three points of a bone span a triangle that tells its turn.
  bool determines_rotation(std::size_t bone) const;

 private:
  std::vector<BoneShape> shapes_;  // by bone
};

}  // namespace mocap::kinematics
