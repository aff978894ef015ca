#include "kinematics/bone_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "base/expects.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::kinematics {
namespace {

// Twice the area of a right triangle with legs of 6 cm and 4 cm. In a smaller triangle the rotation about its longest
// side is hardly observed. Chosen by hand; not yet measured.
constexpr double kMinTriangleArea_m2 = 0.06 * 0.04;

Eigen::Vector3d position_in(const MarkerSet& set, const MarkerOnBone& marker, int bone) {
  if (marker.bone == bone) return marker.offset_m;
  return set.skeleton.bones[static_cast<std::size_t>(marker.bone)].rest_offset_m;
}

// Farthest point selection: begins with the first point; each next point is farthest from all points before it.
void keep_most_spread(std::vector<ShapePoint>& points) {
  for (std::size_t next = 1; next < std::min(points.size(), kMaxShapePoints); ++next) {
    const auto nearest_distance_m = [&](const ShapePoint& point) {
      double nearest = 1e9;
      for (std::size_t i = 0; i < next; ++i)
        nearest = std::min(nearest, (point.position_m - points[i].position_m).norm());
      return nearest;
    };
    const auto farthest = std::max_element(
        points.begin() + static_cast<std::ptrdiff_t>(next), points.end(),
        [&](const ShapePoint& a, const ShapePoint& b) { return nearest_distance_m(a) < nearest_distance_m(b); });
    std::iter_swap(points.begin() + static_cast<std::ptrdiff_t>(next), farthest);
  }
  if (points.size() > kMaxShapePoints) points.resize(kMaxShapePoints);
}

}  // namespace

BoneShapes::BoneShapes(const MarkerSet& set) : shapes_(set.skeleton.bones.size()) {
  const auto& bones = set.skeleton.bones;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const int bone = static_cast<int>(b);
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      const MarkerOnBone& marker = set.markers[m];
      const bool in_child_joint = bones[static_cast<std::size_t>(marker.bone)].parent == bone && sits_in_joint(marker);
      if (marker.bone == bone || in_child_joint)
        shapes_[b].points.push_back({static_cast<int>(m), position_in(set, marker, bone)});
    }
    keep_most_spread(shapes_[b].points);
    const int parent = bones[b].parent;
    if (parent < 0) continue;
    shapes_[b].joints.push_back({parent, Eigen::Vector3d::Zero(), bones[b].rest_offset_m});
    shapes_[static_cast<std::size_t>(parent)].joints.push_back({bone, bones[b].rest_offset_m, Eigen::Vector3d::Zero()});
  }
}

void BoneShapes::refit(const MarkerSet& set) {
  MOCAP_EXPECTS(set.skeleton.bones.size() == shapes_.size());
  const auto& bones = set.skeleton.bones;
  for (std::size_t b = 0; b < shapes_.size(); ++b) {
    for (ShapePoint& point : shapes_[b].points)
      point.position_m = position_in(set, set.markers[static_cast<std::size_t>(point.marker)], static_cast<int>(b));
    for (ShapeJoint& joint : shapes_[b].joints) {
      const bool is_parent = bones[b].parent == joint.bone;
      (is_parent ? joint.joint_in_neighbour_m : joint.joint_in_bone_m) =
          bones[is_parent ? b : static_cast<std::size_t>(joint.bone)].rest_offset_m;
    }
  }
}

void BoneShapes::archive(Archive& members) {
  for (BoneShape& shape : shapes_) {
    for (ShapePoint& point : shape.points) members(point.position_m);
    for (ShapeJoint& joint : shape.joints) members(joint.joint_in_bone_m, joint.joint_in_neighbour_m);
  }
}

bool BoneShapes::determines_rotation(std::size_t bone) const {
  const auto& points = shapes_[bone].points;
  for (std::size_t i = 0; i + 2 < points.size(); ++i) {
    for (std::size_t j = i + 1; j + 1 < points.size(); ++j) {
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        const Eigen::Vector3d area =
            (points[j].position_m - points[i].position_m).cross(points[k].position_m - points[i].position_m);
        if (area.norm() > kMinTriangleArea_m2) return true;
      }
    }
  }
  return false;
}

}  // namespace mocap::kinematics
