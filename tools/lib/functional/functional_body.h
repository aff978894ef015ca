#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "lib/functional/rigid_segments.h"
#include "model/skeleton.h"

namespace mocap::functional {

/// How a bone turns in its parent, as the take shows it.
struct FoundJoint {
  std::string bone = {}, parent = {};
  double rms_m = 0.0;                              ///< how much the joint moves in either segment
  std::optional<Eigen::Vector3d> hinge_axis = {};  ///< unit, in rest pose; empty: about several axes, or not observed
  double hinge_range_rad = 0.0;
};

/// A body that was found in the motion of labelled markers.
struct FunctionalBody {
  MarkerSet marker_set;
  std::vector<FoundJoint> joints;  ///< by bone, without the root
};

/// Finds the rigid segments of a take, the joints between them, and the tree of joints that move least (Kirk, O'Brien
/// and Forsyth, CVPR 2005: minimum spanning tree). One segment becomes one bone. Segments of one or two markers have no
/// orientation and become ends of the tree. The root is the segment in the middle of the tree.
///
/// Rest pose is the pose in the frame that shows most markers: the axes of all bones are those of the world there.
/// Joints turn as far as the take shows, and 30 degrees further. A bone has the name of its first marker, or what the
/// names of its markers begin or end with.
///
/// At most 4000 frames are used, evenly spread. A marker that is seldom seen with the others is left out. `labels`:
/// names of the markers of the take, z is up. Fails with InvalidArgument if no segment has three markers off a line, or
/// if there are more than kMaxLabels markers.
Result<FunctionalBody> find_body(const bodyfit::LabelledTake& take, const std::vector<std::string>& labels,
                                 const std::string& name, const SegmentSettings& settings = {});

}  // namespace mocap::functional
