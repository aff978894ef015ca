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
#include "pose/pose_smoother.h"
#include "pose/pose_transition_smoother.h"
#include "pose/skeleton_tracker.h"
#include "solve/tree_solver.h"

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
  void solve(SubjectLabels& labels, std::span<const NamedRay> rays, std::span<const SurmisedMarker> surmised,
             Timestamp at, SubjectPose& into);
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
  struct RayMemory {
    CameraId camera;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    Timestamp at;
    int sets = 0;  // that it was followed for
  };
  enum class Seen : std::uint8_t { No, Ray, detect::Measured };

  void gather(const SubjectLabels& labels, Timestamp at);
  bool told_by_ray(std::size_t marker) const;
  void gather_surmised(SubjectId id, std::span<const SurmisedMarker> surmised);
  void gather_rays(SubjectId id, std::span<const NamedRay> rays, Timestamp at);
  bool believed(std::size_t marker, const NamedRay& ray, Timestamp at);
  void note_seen(std::size_t marker, Seen how);
  void find_changes(Timestamp at);
  void begin_anew(Timestamp at);
  void show(Timestamp at, SubjectPose& into);
  void show_motion(BoneMemory& memory, const Eigen::Quaterniond& turned_from, double step_s, BonePose& bone) const;
  float confidence_of(std::size_t bone) const;
  bool bone_seen(std::size_t bone) const;
  void wear_refit();
  void learn_skin(Timestamp at);
  void judge_places(Timestamp at);
  void fill(SubjectLabels& labels, Timestamp at);

  SolveSettings settings_;
  pose::BodyFollower body_;
  pose::PoseEaser easer_;
  pose::PoseSmoother smoother_;
  std::vector<int> parents_;
  std::vector<BoneMemory> bones_;
  std::vector<RayMemory> rays_;                  // by marker
  std::vector<Eigen::Matrix3d> covariances_m2_;  // of the place that the body tells, by marker
  std::vector<Seen> how_seen_;                   // by marker, in this set
  std::vector<const NamedRay*> ray_of_;          // by marker: that is believed in this set
  std::vector<bool> turn_shows_;                 // by bone: some marker is moved by its turn
  std::vector<int> own_markers_;                 // by bone
  std::vector<int> seen_markers_;                // by bone, in this set
  std::vector<std::uint8_t> changed_;            // by bone: other markers tell it now
  std::vector<std::uint8_t> changed_near_;
  std::vector<kinematics::Observation> seen_;
  std::vector<Pose> world_;  // as shown
  Timestamp shown_at_;
  Timestamp skin_at_;
  double usual_residual_m_ = 0.0;
  double skin_sigma_m_ = 0.0;        // of a marker on this body
  bool told_ = false;                // the last fit told the pose
  bool fresh_ = true;                // nothing shown yet
  std::optional<SubjectFit> refit_;  // to be worn in the next set
  std::vector<Pose> as_before_;      // locals of the body that was worn until this set
  bool refitted_ = false;            // it is another in this set
};

}  // namespace mocap::solve
