#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/archive.h"
#include "model/points.h"

namespace mocap {

/// Maps points of frame `From` to frame `To`: to = rotation * from + translation. Named `to_from`, so that in a
/// product the inner names meet.
template <class To, class From>
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< m

  To operator*(const From& point) const { return To{rotation * point.v + translation}; }

  template <class Origin>
  RigidTransform<To, Origin> operator*(const RigidTransform<From, Origin>& from_origin) const {
    return {rotation * from_origin.rotation, rotation * from_origin.translation + translation};
  }

  RigidTransform<From, To> inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

using CameraFromWorld = RigidTransform<CameraPoint, WorldPoint>;

/// Position and orientation of a bone in its parent's or in the world's frame.
struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();            ///< m
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit

  Eigen::Vector3d operator*(const Eigen::Vector3d& point_m) const { return rotation * point_m + position; }
  Pose operator*(const Pose& inner) const { return {*this * inner.position, rotation * inner.rotation}; }
  Pose inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {-(back * position), back};
  }

  void archive(Archive& members) { members(position, rotation); }
};

}  // namespace mocap
