#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "base/bounded_vector.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"
#include "model/transform.h"

namespace mocap {

enum class SubjectPhase {
  Searching,  ///< nobody recognised yet
  Tracking,
  Lost,  ///< was tracked, and too little of it is seen now
};

enum class LabelState {
  Lost,      ///< nobody knows where it is
  Measured,  ///< cameras saw it in this set
  Filled,    ///< carried on by its motion, or told by the body; on the ray of the one camera that sees it, if one does
};

/// One named marker of one subject at one instant.
struct LabelledMarker {
  LabelState state = LabelState::Lost;
  WorldPoint position;  ///< means nothing when Lost
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  double residual_px = 0.0;  ///< 0 when not measured
  std::uint32_t cameras =
      0;                    ///< that see it; 1 when Filled: a ray holds it in place across, the body tells how far off
  float confidence = 0.0F;  ///< that the name is right, 0 to 1
  TrackId track;            ///< that bears the name, while one does
};

/// The names of one subject at one instant, in the order of its marker set.
struct SubjectLabels {
  SubjectId subject;
  SubjectPhase phase = SubjectPhase::Searching;
  BoundedVector<LabelledMarker, kMaxLabels> markers;
};

using Labels = BoundedVector<SubjectLabels, kMaxSubjects>;

enum class BoneState {
  Lost,      ///< no pose
  Measured,  ///< its own markers told the pose
  Filled,    ///< the body's model told the pose
};

struct BonePose {
  Pose world_from_bone;
  Pose parent_from_bone;  ///< the root's parent is the world
  BoneState state = BoneState::Lost;
  float confidence = 0.0F;  ///< 0 to 1: about the probability that it is within 30 mm of where it is told
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< of its joint in the world, over about 20 ms
  Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();    ///< its turn in the world, about the world's axes, likewise
};

/// The skeleton of one subject at one instant, bones in the order of its skeleton; empty unless Tracking.
struct SubjectPose {
  SubjectId subject;
  BoundedVector<BonePose, kMaxBones> bones;
  double residual_m = 0.0;         ///< rms of the markers from where the skeleton puts them
  double smoothing_delay_s = 0.0;  ///< by which smoothing made this pose late; 0 without
};

using Poses = BoundedVector<SubjectPose, kMaxSubjects>;

/// A subject's marker set after it was fitted to the body that wears it: the numbers that changed.
struct SubjectFit {
  SubjectId subject;
  std::uint32_t description_version = 0;                        ///< of the first snapshot that uses it
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;     ///< by bone
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;  ///< by marker
  double residual_m = 0.0;                                      ///< rms of the markers in the pose that was fitted
};

}  // namespace mocap
