#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "bodyfit/fit_subject.h"
#include "lib/functional/segment_motion.h"

namespace mocap::functional {

/// The joint between two segments: the point that moves least in either.
struct FunctionalJoint {
  Eigen::Vector3d in_one_m = Eigen::Vector3d::Zero();  ///< in the frame of the first segment
  Eigen::Vector3d in_other_m =
      Eigen::Vector3d::Zero();  ///< in the frame of the second one; zero if it has no orientation
  /// rms distance of both points; if the second segment has no orientation, the standard deviation of the distances of
  /// its markers from the joint
  double rms_m = 0.0;
  double apart_m = 0.0;  ///< mean distance of the two markers that are nearest to each other
};

/// The centre of rotation of two segments with orientation: least squares over all frames that show both. Along
/// directions that the motion does not determine (the axis of a hinge, all of them if the joint does not move) the
/// joint is near the middle of the two markers that are nearest to each other. Nothing if fewer than three frames show
/// both, or if no frame shows a marker of each.
///
/// Source: Ehrig et al., "A survey of formal methods for determining the centre of rotation of ball joints" (J.
/// Biomech. 2006), symmetrical centre of rotation estimation (SCoRE).
std::optional<FunctionalJoint> find_joint(const bodyfit::LabelledTake& take, const SegmentMotion& one,
                                          const SegmentMotion& other);

/// The joint if the second segment has no orientation: the centre, in the first segment, of the spheres on which its
/// markers move. Nothing if fewer than three frames show the first segment, or if no frame shows a marker of each.
///
/// Source: Gamage and Lasenby, "New least squares solutions for estimating the average centre of rotation and the axis
/// of rotation" (J. Biomech. 2002).
std::optional<FunctionalJoint> find_joint_of_points(const bodyfit::LabelledTake& take, const SegmentMotion& one,
                                                    const SegmentMotion& points);

/// How two segments with orientation rotate relative to each other.
struct JointRotation {
  Eigen::Vector3d least_rad = Eigen::Vector3d::Zero();  ///< 1st percentile of the rotation vector, by axis of the first
  Eigen::Vector3d most_rad = Eigen::Vector3d::Zero();   ///< 99th percentile
  std::optional<Eigen::Vector3d> hinge_axis;  ///< unit, in the first segment; empty: the joint turns about more axes
  double hinge_range_rad = 0.0;               ///< about that axis
};

/// The rotation of `other` in `one` over all frames that show both, relative to the reference frame of track_segment.
/// Zero and no hinge if fewer than three frames show both. The joint is a hinge if it turns about its principal axis by
/// more than 20 degrees, and about the others by less than a quarter of that.
JointRotation measure_rotation(const SegmentMotion& one, const SegmentMotion& other);

}  // namespace mocap::functional
