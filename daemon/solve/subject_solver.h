#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
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

/// The solver of one subject: tracks its body pose from set to set (`SkeletonTracker`), eases jumps of the published
/// pose (`PoseTransitionSmoother`), smooths it if the settings ask for it (`PoseSmoother`), and fills in the labels of
/// markers that were not measured.
///
/// Positions are in world coordinates, m. Allocates in the constructor only. One thread; reads no clock.
class SubjectSolver {
 public:
  SubjectSolver(const SolveSettings& settings, const Subject& subject);

  /// Writes the pose at `at` to `into`, and fills in the labels that were not measured: Filled with the position by the
  /// pose, or Lost after `fill_for_s`. `rays` and `ambiguous_observations` may contain those of other subjects. `into`
  /// has no bones if the subject is not tracked, or its markers determine no pose yet. A new identification of the
  /// subject, or a set that is older than the last one, begins a new track.
  void solve(SubjectLabels& labels, std::span<const LabelledBearing> rays,
             std::span<const AmbiguousObservation> ambiguous_observations, Timestamp at, SubjectPose& into);
  /// Replaces bone lengths and marker offsets. While a body is tracked, the change takes effect in the next `solve`. A
  /// fit at an identification also ends what was learned about the joints of the person before.
  void refit(const SubjectFit& fit);
  /// Takes over body and pose of the same subject; the settings stay. Other smoothing begins anew. `before` is not used
  /// afterwards.
  void adopt(SubjectSolver& before);
  /// Ends the track; the body is kept.
  void end_track();
  /// Appends the predicted position and covariance of each marker at `at`. Appends nothing if no body is tracked.
  void predict(SubjectId id, Timestamp at, PredictedMarkers& into);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  struct BoneMemory {
    Eigen::Quaterniond published_world = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond published_local = Eigen::Quaterniond::Identity();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
    Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();
    std::uint64_t markers = 0;      // hash of the set of markers that observed the bone in the last set
    std::uint64_t markers_now = 0;  // the same of this set
    Timestamp changed_at;

    void archive(Archive& members) {
      members(published_world, published_local, position, velocity_m_s, spin_rad_s, markers, markers_now, changed_at);
    }
  };
  // Last bearing-only observation of a marker.
  struct BearingMemory {
    CameraId camera;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    Timestamp at;
    int sets = 0;  // consecutive sets with this camera

    void archive(Archive& members) { members(camera, direction, at, sets); }
  };
  enum class ObservationKind : std::uint8_t { None, Bearing, Measured };

  void gather(const SubjectLabels& labels);
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
  bool is_bone_observed(std::size_t bone) const;
  void set_body(const SubjectFit& fit);
  void apply_refit();
  void update_skin_sigma(Timestamp at);
  void compute_marker_covariances(Timestamp at);
  void fill(SubjectLabels& labels, Timestamp at);

  SolveSettings settings_;
  pose::SkeletonTracker body_;
  pose::PoseTransitionSmoother transition_smoother_;
  pose::PoseSmoother smoother_;
  std::vector<int> parents_;
  std::vector<BoneMemory> bones_;
  std::vector<BearingMemory> bearing_memories_;     // by marker
  std::vector<Eigen::Matrix3d> covariances_m2_;     // by marker: of the position by the pose
  std::vector<ObservationKind> observation_kind_;   // by marker, in this set
  std::vector<const LabelledBearing*> bearing_of_;  // by marker: accepted in this set; null: none
  std::vector<bool> rotation_is_visible_;           // by bone: its rotation moves some marker
  std::vector<int> own_markers_;                    // by bone: markers on the bone
  std::vector<int> seen_markers_;                   // by bone: of these, measured in this set
  std::vector<std::uint8_t> changed_;               // by bone: observed by other markers than before
  std::vector<std::uint8_t> changed_neighbours_;    // scratch
  std::vector<kinematics::Observation> observations_;
  std::vector<Pose> world_;            // published poses
  std::uint32_t identifications_ = 0;  // of the track
  Timestamp published_at_;
  Timestamp skin_at_;
  double usual_residual_m_ = 0.0;
  double skin_sigma_m_ = 0.0;              // standard deviation of a marker from its position on this body
  bool pose_is_observable_ = false;        // the observations of the last fit determine the pose
  bool is_first_set_ = true;               // no pose published since the start of the track
  std::optional<SubjectFit> refit_;        // takes effect in the next set
  std::vector<Pose> locals_before_refit_;  // local poses with the old body model
  bool refitted_ = false;                  // the body model changed in this set
};

}  // namespace mocap::solve
