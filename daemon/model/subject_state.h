#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "model/bounds.h"
#include "model/camera_bits.h"
#include "model/ids.h"
#include "model/points.h"
#include "model/transform.h"

namespace mocap {

enum class SubjectPhase {
  Searching,  ///< not identified yet
  Tracking,
  Lost,  ///< was tracked; too few markers are seen now
};

enum class LabelState {
  Lost,      ///< position unknown
  Measured,  ///< triangulated in this set
  Filled,    ///< predicted by its motion or by the body; on the camera's ray if exactly one camera sees it
};

/// One labelled marker of one subject at one instant.
struct LabelledMarker {
  LabelState state = LabelState::Lost;
  WorldPoint position;  ///< undefined when Lost
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  double residual_px = 0.0;  ///< 0 when not measured
  std::uint32_t cameras =
      0;  ///< number of cameras that see it; 1 when Filled: the ray fixes the direction, the body the depth
  CameraBits seen_by = 0;   ///< these cameras, if they are known
  float confidence = 0.0F;  ///< probability that the label is right, 0 to 1
  TrackId track;            ///< the track that has the label, if any
};

/// The labels of one subject at one instant, in the order of its marker set.
struct SubjectLabels {
  SubjectId subject;
  SubjectPhase phase = SubjectPhase::Searching;
  BoundedVector<LabelledMarker, kMaxLabels> markers;
  /// How often the subject was identified so far. A new identification begins a new track of the body, even if the
  /// phase was Tracking in the set before. Not published.
  std::uint32_t identifications = 0;
};

using Labels = BoundedVector<SubjectLabels, kMaxSubjects>;

enum class BoneState {
  Lost,      ///< no pose
  Measured,  ///< its own markers determine the pose
  Filled,    ///< the model of the body determines the pose
};

struct BonePose {
  Pose world_from_bone;
  Pose parent_from_bone;  ///< the root's parent is the world
  BoneState state = BoneState::Lost;
  float confidence = 0.0F;  ///< 0 to 1: approximate probability that the true position is within 30 mm
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< velocity of its joint in the world, over about 20 ms
  Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();    ///< angular velocity in the world frame, likewise
};

/// The skeleton of one subject at one instant, bones in the order of its skeleton; empty unless Tracking.
struct SubjectPose {
  SubjectId subject;
  BoundedVector<BonePose, kMaxBones> bones;
  double residual_m = 0.0;         ///< rms distance of the markers from their positions on the skeleton
  double smoothing_delay_s = 0.0;  ///< delay that smoothing adds to this pose; 0 without smoothing
};

using Poses = BoundedVector<SubjectPose, kMaxSubjects>;

/// The offsets of a subject's marker set after it was fitted to the body.
struct SubjectFit {
  SubjectId subject;
  std::uint32_t description_version = 0;  ///< description version of the first snapshot that uses the fit
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;     ///< by bone
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;  ///< by marker
  double residual_m = 0.0;                                      ///< rms of the markers in the fitted pose
  bool in_any_pose = false;                                     ///< fitted to one instant of an unknown pose
  bool at_identification = false;  ///< fitted when the subject was identified: maybe the body of another person

  void archive(Archive& members) {
    members(subject, description_version, rest_offsets_m, marker_offsets_m, residual_m, in_any_pose, at_identification);
  }
};

}  // namespace mocap
