#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <span>
#include <vector>

#include "base/time.h"
#include "geometry/rigid_fit.h"
#include "kinematics/pose_fit.h"
#include "model/skeleton.h"
#include "pose/depth_gaussian_sum.h"
#include "pose/hinge_axis_calibration.h"
#include "pose/initial_pose_solver.h"
#include "pose/joint_drift_covariance.h"
#include "pose/running_mean_rotation.h"
#include "pose/swivel_plane_prior.h"

namespace mocap::pose {

struct SkeletonTrackerSettings {
  double outlier_m = 0.05;  ///< a marker further off its place than this hardly counts
  int max_iterations = 6;   ///< of a fit; a first pose has ten times as many
  /// A turn is told as far as markers tell more than this, rad: a marker on skin of 3 mm tells, 4 cm from the axis,
  /// 0.08.
  double observability_prior_rad = 0.5;
  /// A turn that markers told a moment ago is better known than by what is common, which takes over with this time
  /// constant; 0: at once.
  double rest_prior_time_constant_s = 20.0;
};

/// Follows one body from instant to instant by the markers that are seen: where it goes on to, what pose explains what
/// is seen, and where, how surely, the markers are that nobody sees.
///
/// One instant: `predict`, then as many tries of `fit` as one likes, then `learn` from the last of them. Hidden joints
/// go on for a moment, then stay, and go back to rest slowly; joints that hardly turn hardly are turned.
///
/// Allocates in the constructor only. Reads no clock.
class SkeletonTracker {
 public:
  SkeletonTracker(const MarkerSet& set, const SkeletonTrackerSettings& settings);

  /// New bone offsets and marker offsets, by bone and by marker.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  bool is_tracking() const noexcept { return is_tracking_; }
  /// How the body's joints bend stays known: it may be lost, and found again.
  void reset();
  /// It is another body.
  void reset_joint_calibration();
  const HingeAxisCalibration& hinge_axes() const noexcept { return hinge_axes_; }
  const SwivelPlanePrior& swivel_planes() const noexcept { return swivel_planes_; }

  /// A first pose. False, and nobody followed, when too little is seen.
  bool start(std::span<const kinematics::Observation> seen, Timestamp at);

  /// Goes to the pose that the motion leads to at `at`; may be asked for any instant, in any order.
  void predict(Timestamp at);
  /// The pose of the last `predict`, moved to what explains `seen`.
  kinematics::PoseFitResult update(std::span<const kinematics::Observation> seen);
  /// The same from the pose of the last `fit`, with hidden joints as free as they may be after the time that they are
  /// hidden: what this reading of the markers costs, to be compared with that of another reading. A cost over `within`
  /// may be told as larger than it is: no more work is spent on a reading that cannot come below.
  kinematics::PoseFitResult evaluate_hypothesis(std::span<const kinematics::Observation> seen,
                                                double max_cost = std::numeric_limits<double>::infinity());
  /// A bone turns in its joint until its `marker` is where its marker `onto_marker` was.
  struct MarkerSwing {
    int marker = 0;
    int onto_marker = 0;
  };
  /// What `explain` tells, looked for near another pose, by its locals, after these swings (of bones but 0).
  kinematics::PoseFitResult evaluate_from(std::span<const Pose> locals, std::span<const MarkerSwing> swings,
                                          std::span<const kinematics::Observation> seen, double max_cost);
  /// Until the next `predict`, these bones (by bone; not 0) may be turned anyhow: they may have followed wrong markers.
  void mark_unreliable(std::span<const char> bones) { unreliable_.assign(bones.begin(), bones.end()); }
  /// Takes the last fit for the truth of its instant.
  void commit(std::span<const kinematics::Observation> seen);

  const kinematics::PoseFit& pose() const noexcept { return pose_; }
  /// The local poses of the last `predict`.
  std::span<const Pose> predicted_locals() const noexcept { return predicted_; }
  double residual_m() const noexcept { return residual_m_; }
  Timestamp committed_at() const noexcept { return committed_at_; }

  /// Where the pose at hand puts a marker, with what was learnt about where it sits.
  Eigen::Vector3d predicted_position(std::size_t marker) const;
  /// How fast its place moves, m/s.
  double speed_of(std::size_t marker) const { return markers_[marker].velocity_m_s.norm(); }
  /// Prepares `predicted_covariance` for the pose at hand, of which `seen` tells. False when that tells nothing.
  [[nodiscard]] bool compute_covariances(std::span<const kinematics::Observation> seen, Timestamp at);
  /// Of a marker's place by the last `compute_covariances`, m^2; grows with the time that its joints are hidden.
  Eigen::Matrix3d predicted_covariance(std::size_t marker) const;

  /// Whether `seen` of the last fit told the turn of a bone, by markers that it moves itself (Direct), of which one
  /// camera alone sees any (Ray), or by markers further down.
  enum class Observability { None, Descendant, BearingOnly, Full };
  Observability bone_observability(std::size_t bone) const { return bones_[bone].observability; }
  bool ever_seen(std::size_t marker) const { return markers_[marker].ever_seen; }
  /// Since a marker was last learnt of; a long time where it never was.
  double unseen_s(std::size_t marker, Timestamp at) const;

 private:
  struct MarkerMemory {
    Timestamp seen_at;
    bool ever_seen = false;
    Eigen::Vector3d bias_m = Eigen::Vector3d::Zero();      // from where the model puts it, in its bone's frame
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // when last learnt
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  };
  struct BoneMemory {
    Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // of the local turn, in the parent's frame
    Timestamp fully_observed_at;                                       // when markers told all of its turn
    Observability observability = Observability::None;
    // Which turns in the parent's frame the markers of the last fit told: 1 along an axis that they told alone, 0 along
    // one that they told nothing of.
    Eigen::Matrix3d observed_fraction = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d previous_observed_fraction = Eigen::Matrix3d::Identity();  // when last learnt
  };

  // A person's joint hardly turns by more than this from set to set against what its motion lets expect, rad.
  static constexpr double kMotionSigma_rad = 0.15;

  void update_observability(std::span<const kinematics::Observation> seen);
  void update_observed_fractions(std::span<const kinematics::Observation> seen);
  kinematics::PosePrior make_prior(std::size_t seen) const;
  kinematics::PoseFitResult solve(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior,
                                  const kinematics::PoseFitEnd& end,
                                  double max_cost = std::numeric_limits<double>::infinity());
  kinematics::PoseFitResult evaluate_from_current(std::span<const kinematics::Observation> seen, double max_cost);
  kinematics::PoseFitResult solve_with_and_without_prior_pose(std::span<const kinematics::Observation> seen,
                                                              const kinematics::PosePrior& prior,
                                                              const kinematics::PoseFitEnd& end);
  kinematics::PoseFitResult resolve_hinge_reflection(std::span<const kinematics::Observation> seen,
                                                     const kinematics::PosePrior& prior,
                                                     const kinematics::PoseFitEnd& end,
                                                     kinematics::PoseFitResult first);
  bool reflect_hinge(std::size_t lower);
  kinematics::PoseFitResult resolve_depth_ambiguity(std::span<const kinematics::Observation> seen,
                                                    const kinematics::PosePrior& prior,
                                                    const kinematics::PoseFitEnd& end, kinematics::PoseFitResult first);
  struct RaySphereIntersection;
  static RaySphereIntersection intersect_reach_sphere(const kinematics::Observation& ray, const Eigen::Vector3d& joint,
                                                      const Eigen::Vector3d& marker);
  bool reinitialise_limb(std::size_t lower, const kinematics::Observation& ray,
                         std::span<const kinematics::Observation> seen, int iterations);
  void update_depth_hypotheses(std::size_t marker, const RaySphereIntersection& intersection, double depth_m);
  bool is_weakly_observed(std::size_t bone) const;
  int find_bearing_only_limb(std::span<const kinematics::Observation> seen, const kinematics::Observation& ray) const;
  void straighten_below(std::size_t lower);
  void swing_marker_to(std::size_t lower, std::size_t marker, const Eigen::Vector3d& place);
  double evaluate_limb_cost(std::size_t lower, std::span<const kinematics::Observation> seen, int iterations);
  bool reinitialise_bone_rotation(std::span<const kinematics::Observation> seen);
  bool reinitialise_bone_rotation(std::size_t bone, std::span<const kinematics::Observation> seen);
  void relax_prior(std::span<const kinematics::Observation> seen, Timestamp at);

  SkeletonTrackerSettings settings_;
  kinematics::PoseFit pose_;
  InitialPoseSolver initial_pose_;
  bool is_tracking_ = false;
  bool refitted_ = false;  // since it last learnt
  Timestamp committed_at_;
  Timestamp at_;  // of the last predict
  double residual_m_ = 0.0;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
  std::vector<BoneMemory> bones_;
  std::vector<MarkerMemory> markers_;
  std::vector<int> bone_depth_;           // by bone
  std::vector<Pose> committed_;           // locals
  std::vector<Pose> predicted_;           // locals
  std::vector<Pose> fitted_;              // locals of the last fit
  std::vector<Pose> start_pose_;          // scratch: locals before a solve
  std::vector<Pose> fallback_pose_;       // scratch: locals before a limb is laid anew
  std::vector<Pose> trial_pose_;          // scratch: locals while it is
  std::vector<Pose> straight_pose_;       // scratch: locals of a limb that hangs on straight
  std::vector<char> is_below_;            // scratch: by bone
  std::vector<Pose> limb_prior_pose_;     // scratch: locals that a limb is held to while it is laid elsewhere
  std::vector<double> squared_error_m2_;  // by bone
  std::vector<int> marker_count_;         // by bone
  JointDriftCovariance joint_drift_;
  RunningMeanRotation mean_rotation_;
  std::vector<DepthGaussianSum> depth_hypotheses_;  // by marker
  HingeAxisCalibration hinge_axes_;
  SwivelPlanePrior swivel_planes_;
  std::vector<double> rest_confidence_;  // of this fit, by bone
  std::vector<double> limit_confidence_;
  std::vector<Eigen::Matrix3d> prior_information_;
  std::vector<double> limb_rest_confidence_;  // the same three while a limb is laid elsewhere
  std::vector<double> limb_limit_confidence_;
  std::vector<Eigen::Matrix3d> limb_prior_information_;
  struct CovarianceInput {
    int marker = 0;
    bool bearing_only = false;
    bool usable = false;
  };
  std::vector<CovarianceInput> covariance_inputs_;  // the observations that `share` of the bones is by
  int covariance_age_ = 0;                          // fits
  std::vector<char> unreliable_;                    // by bone
  std::vector<char> reinitialised_;                 // by bone: in the last fit it was laid elsewhere
  std::vector<geometry::PointPair> pairs_;
};

}  // namespace mocap::pose
