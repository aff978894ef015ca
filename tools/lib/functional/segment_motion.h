#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "bodyfit/fit_subject.h"
#include "lib/functional/rigid_segments.h"
#include "model/transform.h"

namespace mocap::functional {

/// A segment and its pose in each frame of a take. The axes of the segment are those of the world in the reference
/// frame; its origin is the mean of its points.
struct SegmentMotion {
  Segment markers = {};
  std::vector<Eigen::Vector3d> shape_m =
      {};  ///< by marker, in the segment's frame; without orientation, in the world of one frame
  Eigen::Vector3d joint_m = Eigen::Vector3d::Zero();  ///< in its frame, if track_segment got the places of a joint
  /// By frame of the take; empty in frames that show fewer than three points off a line. Empty as a whole: the segment
  /// has fewer than three points off a line, so that it has no orientation.
  std::vector<std::optional<Pose>> world_from_segment = {};

  bool has_orientation() const { return !world_from_segment.empty(); }
};

/// Computes the mean shape of a segment and its poses by rigid fits and averages in turns (generalised Procrustes
/// analysis, Gower 1975). The rotation of the segment is the identity in the frame `reference`, or in the first frame
/// that shows the segment if `reference` does not.
///
/// `joint_places_m`: by frame, a joint of the segment in the world, not finite where it is unknown; or none. The joint
/// counts as one more point, so that two markers have an orientation too.
SegmentMotion track_segment(const bodyfit::LabelledTake& take, const Segment& segment, std::size_t reference,
                            std::span<const Eigen::Vector3d> joint_places_m = {});

}  // namespace mocap::functional
