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
  double rms_m = 0.0;                              ///< as FunctionalJoint::rms_m
  std::optional<Eigen::Vector3d> hinge_axis = {};  ///< unit, in rest pose; empty: about several axes, or not observed
  double hinge_range_rad = 0.0;
};

/// A body that was found in the motion of labelled markers.
struct FunctionalBody {
  MarkerSet marker_set;
  std::vector<FoundJoint> joints;  ///< by bone, without the root
};

/// Finds the rigid segments of a take, the joints between them, and the tree of joints that move least (Kirk, O'Brien
/// and Forsyth, CVPR 2005: minimum spanning tree). One segment becomes one bone. A segment of two markers gets its
/// orientation from its joint, as a third point. A segment of one marker has no orientation and is an end of the tree.
/// The root is the segment in the middle of the tree.
///
/// Rest pose: the axes of each bone are those of the world in the frame that shows most markers, or in the first frame
/// that shows the bone. The range of a joint is the 1st to 99th percentile of its rotations and 30 degrees on each
/// side. A bone has the common beginning of the names of its markers, else their common end, else the name of the
/// first.
///
/// At most 4000 frames are used, evenly spread. Segments without a joint to the tree are left out: a single marker that
/// no frame shows together with a segment of the tree, other segments that share fewer than three frames. `labels`:
/// names of the markers of the take, z is up. Fails with InvalidArgument if no segment has three markers off a line, or
/// if there are more than kMaxLabels markers.
Result<FunctionalBody> find_body(const bodyfit::LabelledTake& take, const std::vector<std::string>& labels,
                                 const std::string& name, const SegmentSettings& settings = {});

}  // namespace mocap::functional
