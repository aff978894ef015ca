#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/time.h"
#include "geometry/rigid_fit.h"
#include "kinematics/pose_fit.h"
#include "model/skeleton.h"
#include "pose/depth_gaussian_sum.h"
#include "pose/hinge_axis_calibration.h"
#include "pose/initial_pose_solver.h"
#include "pose/joint_drift_covariance.h"
#include "pose/running_mean_rotation.h"
#include "pose/set_interval.h"
#include "pose/swivel_plane_prior.h"

namespace mocap::pose {

struct SkeletonTrackerSettings {
  double outlier_m = 0.05;  ///< scale of the robust cost: a marker farther off has little weight
  int max_iterations = 6;   ///< of one fit; each of the three fits of an initial pose has five times as many
  /// Standard deviation of a joint rotation against which observability is judged: the observed fraction is 1 -
  /// posterior variance / this variance. A marker with 3 mm skin motion, 4 cm from the axis, gives a posterior of 0.08
  /// rad.
  double observability_prior_rad = 0.5;
  /// Time constant with which the rest pose prior returns after markers last observed a joint; 0: at once.
  double rest_prior_time_constant_s = 20.0;
};

/// Tracks the pose of one body: predicts it, fits it to the labelled markers of a set, and predicts where undetected
/// markers are, with covariance. The pose is a maximum a posteriori estimate; mechanisms.md lists the priors and the
/// discrete ambiguities.
///
/// For each set: `predict`, then any number of `update` and `evaluate_...` calls, then `commit` of the last pose.
/// Joints that no marker observes coast for about 0.1 s, then revert to their running mean rotation, and over seconds
/// to the rest pose.
///
/// Allocates in the constructor only. Reads no clock. One thread at a time.
class SkeletonTracker {
 public:
  SkeletonTracker(const MarkerSet& set, const SkeletonTrackerSettings& settings);

  /// Uses other settings from the next call on.
  void set_settings(const SkeletonTrackerSettings& settings) { settings_ = settings; }

  /// Takes over fitted bone offsets and marker offsets, by bone and by marker.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  bool is_tracking() const noexcept { return is_tracking_; }
  /// Ends tracking. Learned hinge axes and swivel planes are kept: the same subject may be found again (identify,
  /// decision 0003).
  void reset();
  /// Forgets learned hinge axes and swivel planes (a new subject).
  void reset_joint_calibration();
  const HingeAxisCalibration& hinge_axes() const noexcept { return hinge_axes_; }
  const SwivelPlanePrior& swivel_planes() const noexcept { return swivel_planes_; }

  /// Computes an initial pose. False, without tracking, if the observations do not determine a rigid alignment.
  bool start(std::span<const kinematics::Observation> seen, Timestamp at);

  /// Sets the pose to the prediction for `at`. May be called for any instant, in any order.
  void predict(Timestamp at);
  /// Fits the last prediction to `seen`.
  kinematics::PoseFitResult update(std::span<const kinematics::Observation> seen);
  /// Cost of a label hypothesis: fits `seen` from the pose of the last `update`, with hidden joints as free as their
  /// drift covariance says. A cost above `max_cost` may be reported larger than it is, because no further starts are
  /// tried for a hypothesis that cannot win.
  kinematics::PoseFitResult evaluate_hypothesis(std::span<const kinematics::Observation> seen,
                                                double max_cost = std::numeric_limits<double>::infinity());
  /// A rotation of a bone in its joint that moves `marker` in the direction of `onto_marker`.
  struct MarkerSwing {
    int marker = 0;
    int onto_marker = 0;
  };
  /// The same, with the search begun at `locals` after these swings (of bones other than the root).
  kinematics::PoseFitResult evaluate_from(std::span<const Pose> locals, std::span<const MarkerSwing> swings,
                                          std::span<const kinematics::Observation> seen, double max_cost);
  /// Until the next `predict`, the flagged bones (by bone; not the root) have the largest drift covariance: they may
  /// have followed wrong labels. If a marker of a flagged bone sits in its joint, the parent has it too, because that
  /// marker observes the rotation of the parent.
  void mark_unreliable(std::span<const char> bones);
  /// Accepts the last fit: updates velocities, marker biases, drift covariances and all learned joint properties.
  void commit(std::span<const kinematics::Observation> seen);

  const kinematics::PoseFit& pose() const noexcept { return pose_; }
  /// Local poses of the last `predict`.
  std::span<const Pose> predicted_locals() const noexcept { return predicted_; }
  double residual_m() const noexcept { return residual_m_; }
  Timestamp committed_at() const noexcept { return committed_at_; }

  /// Predicted position of a marker in the current pose, with its learned bias.
  Eigen::Vector3d predicted_position(std::size_t marker) const;
  /// Speed of a marker between the last two commits, m/s.
  double speed_of(std::size_t marker) const { return markers_[marker].velocity_m_s.norm(); }
  /// Prepares `predicted_covariance` for the current pose, observed by `seen`. False if the equations are not positive
  /// definite.
  [[nodiscard]] bool compute_covariances(std::span<const kinematics::Observation> seen, Timestamp at);
  /// Covariance of a marker's position by the last `compute_covariances`, m^2; grows with the time for which the joints
  /// of the marker's bones are unobserved.
  Eigen::Matrix3d predicted_covariance(std::size_t marker) const;

  /// How `seen` of the last fit observes a bone: not at all, by markers of descendants only, by one camera's ray of an
  /// own marker, or by an own marker in 3D. A marker in a joint counts for the parent.
  enum class Observability { None, Descendant, BearingOnly, Full };
  Observability bone_observability(std::size_t bone) const { return bones_[bone].observability; }
  bool ever_seen(std::size_t marker) const { return markers_[marker].ever_seen; }
  /// Time since a marker was last observed; 1000 s if it never was.
  double unseen_s(std::size_t marker, Timestamp at) const;

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  struct MarkerMemory {
    Timestamp seen_at;
    bool ever_seen = false;
    Eigen::Vector3d bias_m = Eigen::Vector3d::Zero();      // observed minus predicted position, in the bone's frame
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // at the last commit
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();

    void archive(Archive& members) { members(seen_at, ever_seen, bias_m, position_m, velocity_m_s); }
  };
  struct BoneMemory {
    Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();  // of the local rotation, in the parent's frame
    Timestamp fully_observed_at;  // when markers last determined the whole rotation
    Observability observability = Observability::None;
    // Part of the rotation that the markers of the last fit observe, in the parent's frame: 1 along an axis that they
    // determine alone, 0 along an unobserved one. I - posterior covariance / prior covariance.
    Eigen::Matrix3d observed_fraction = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d previous_observed_fraction = Eigen::Matrix3d::Identity();  // at the last commit

    void archive(Archive& members) {
      members(angular_velocity_rad_s, fully_observed_at, observability, observed_fraction, previous_observed_fraction);
    }
  };

  // Standard deviation of a joint rotation from its prediction, from set to set. Chosen by hand; not yet measured.
  static constexpr double kMotionSigma_rad = 0.15;

  // Time constant with which the velocity of a hidden joint decays. The rotations of shoulders, elbows, hips and knees
  // in recordings, 0.05 to 0.5 s ahead, are predicted best with 0.05 to 0.1 s (decision 0012).
  static constexpr double kCoastTimeConstant_s = 0.1;
  // After a longer gap between sets velocities carry no information; the prediction extrapolates at most this far.
  // Chosen by hand; not yet measured.
  static constexpr double kMaxGap_s = 0.25;

  // A fit ends when no joint moves or rotates by more than this in one step, m or rad. Gauss-Newton converges
  // quadratically near the minimum, so less than a twentieth of a degree is left.
  static constexpr double kConvergedStep = 5e-4;

  void archive_covariance_inputs(Archive& members);
  void commit_velocities(bool is_seen, bool motion, double step_s);
  void learn_joint(std::size_t b, double step_s);
  void commit_markers(std::span<const kinematics::Observation> seen, bool motion, double step_s);
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
  bool refitted_ = false;  // since the last commit
  Timestamp committed_at_;
  Timestamp at_;  // of the last `predict`
  double residual_m_ = 0.0;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
  SetInterval interval_;
  std::vector<BoneMemory> bones_;
  std::vector<MarkerMemory> markers_;
  std::vector<int> bone_depth_;           // by bone: number of ancestors
  std::vector<double> locked_axes_;       // by bone: their number
  std::vector<Pose> committed_;           // locals at the last commit
  std::vector<Pose> predicted_;           // locals of the last `predict`
  std::vector<Pose> fitted_;              // locals of the last `update`
  std::vector<Pose> start_pose_;          // scratch: locals before a solve
  std::vector<Pose> fallback_pose_;       // scratch: locals before a reinitialisation
  std::vector<Pose> trial_pose_;          // scratch: locals during a reinitialisation
  std::vector<Pose> straight_pose_;       // scratch: locals with a limb in rest pose
  std::vector<char> is_below_;            // scratch, by bone: the limb that is reinitialised
  std::vector<Pose> limb_prior_pose_;     // scratch: mean of the prior while both branches of a ray are compared
  std::vector<double> squared_error_m2_;  // by bone, of its own markers
  std::vector<int> marker_count_;         // by bone, of its own markers
  JointDriftCovariance joint_drift_;
  RunningMeanRotation mean_rotation_;
  std::vector<DepthGaussianSum> depth_hypotheses_;  // by marker
  HingeAxisCalibration hinge_axes_;
  SwivelPlanePrior swivel_planes_;
  std::vector<double> rest_confidence_;  // by bone, of the current fit
  std::vector<double> limit_confidence_;
  std::vector<Eigen::Matrix3d> prior_information_;
  std::vector<double> limb_rest_confidence_;  // the same three while both branches of a ray are compared
  std::vector<double> limb_limit_confidence_;
  std::vector<Eigen::Matrix3d> limb_prior_information_;
  struct CovarianceInput {
    int marker = 0;
    bool bearing_only = false;
    bool usable = false;

    void archive(Archive& members) { members(marker, bearing_only, usable); }
  };
  std::vector<CovarianceInput> covariance_inputs_;  // the observations that the observed fractions were computed from
  int covariance_age_ = 0;                          // number of fits since then
  std::vector<char> unreliable_;                    // by bone
  std::vector<char> reinitialised_;                 // by bone: the last fit reinitialised it, so its step is no motion
  std::vector<geometry::PointPair> pairs_;
};

}  // namespace mocap::pose
