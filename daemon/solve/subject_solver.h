#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/time.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"
#include "pose/pose_smoother.h"
#include "pose/pose_transition_smoother.h"
#include "pose/skeleton_tracker.h"
#include "solve/solve_settings.h"

namespace mocap::solve {

/// The solver of one subject: its body is followed from set to set, and what is shown of it neither jumps nor, where
/// that is wished for, trembles.
///
/// Allocates in the constructor only.
class SubjectSolver {
 public:
  SubjectSolver(const SolveSettings& settings, const Subject& subject);

  /// The pose of this set, and the labels of markers that were not measured filled in. `rays` are those of this subject
  /// and of others.
  void solve(SubjectLabels& labels, std::span<const LabelledBearing> rays,
             std::span<const AmbiguousObservation> ambiguous_observations, Timestamp at, SubjectPose& into);
  void refit(const SubjectFit& fit);
  void predict(SubjectId id, Timestamp at, Expected& into);

 private:
  struct BoneMemory {
    Timestamp seen_at;
    Eigen::Quaterniond shown_world = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond shown_local = Eigen::Quaterniond::Identity();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();
    std::uint64_t markers = 0;  // that told it in the last set, and in this one: a sum that differs where they do
    std::uint64_t markers_now = 0;
    Timestamp changed_at;
  };
  // Of the camera that alone saw a marker.
  struct BearingMemory {
    CameraId camera;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    Timestamp at;
    int sets = 0;  // that it was followed for
  };
  enum class ObservationKind : std::uint8_t { None, Bearing, Measured };

  void gather(const SubjectLabels& labels, Timestamp at);
  bool is_covered_by_bearing(std::size_t marker) const;
  void gather_ambiguous(SubjectId id, std::span<const AmbiguousObservation> ambiguous_observations);
  void gather_bearings(SubjectId id, std::span<const LabelledBearing> rays, Timestamp at);
  bool passes_bearing_gate(std::size_t marker, const LabelledBearing& ray, Timestamp at);
  void record_observation(std::size_t marker, ObservationKind kind);
  void detect_observation_changes(Timestamp at);
  void restart(Timestamp at);
  void write_pose(Timestamp at, SubjectPose& into);
  void update_motion(BoneMemory& memory, const Eigen::Quaterniond& previous_rotation, double step_s,
                     BonePose& bone) const;
  float confidence_of(std::size_t bone) const;
  bool bone_seen(std::size_t bone) const;
  void apply_refit();
  void update_skin_sigma(Timestamp at);
  void compute_marker_covariances(Timestamp at);
  void fill(SubjectLabels& labels, Timestamp at);

  SolveSettings settings_;
  pose::SkeletonTracker body_;
  pose::PoseTransitionSmoother easer_;
  pose::PoseSmoother smoother_;
  std::vector<int> parents_;
  std::vector<BoneMemory> bones_;
  std::vector<BearingMemory> bearing_memories_;     // by marker
  std::vector<Eigen::Matrix3d> covariances_m2_;     // of the place that the body tells, by marker
  std::vector<ObservationKind> observation_kind_;   // by marker, in this set
  std::vector<const LabelledBearing*> bearing_of_;  // by marker: that is believed in this set
  std::vector<bool> rotation_is_visible_;           // by bone: some marker is moved by its turn
  std::vector<int> own_markers_;                    // by bone
  std::vector<int> seen_markers_;                   // by bone, in this set
  std::vector<std::uint8_t> changed_;               // by bone: other markers tell it now
  std::vector<std::uint8_t> changed_neighbours_;
  std::vector<kinematics::Observation> observations_;
  std::vector<Pose> world_;  // as shown
  Timestamp shown_at_;
  Timestamp skin_at_;
  double usual_residual_m_ = 0.0;
  double skin_sigma_m_ = 0.0;              // of a marker on this body
  bool pose_is_observable_ = false;        // the last fit told the pose
  bool is_first_set_ = true;               // nothing shown yet
  std::optional<SubjectFit> refit_;        // to be worn in the next set
  std::vector<Pose> locals_before_refit_;  // locals of the body that was worn until this set
  bool refitted_ = false;                  // it is another in this set
};

}  // namespace mocap::solve
