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

struct FollowSettings {
  double outlier_m = 0.05;  ///< a marker further off its place than this hardly counts
  int max_iterations = 6;   ///< of a fit; a first pose has ten times as many
  /// A turn is told as far as markers tell more than this, rad: a marker on skin of 3 mm tells, 4 cm from the axis,
  /// 0.08.
  double told_rad = 0.5;
  /// A turn that markers told a moment ago is better known than by what is common, which takes over with this time
  /// constant; 0: at once.
  double remembered_s = 20.0;
};

/// Follows one body from instant to instant by the markers that are seen: where it goes on to, what pose explains what
/// is seen, and where, how surely, the markers are that nobody sees.
///
/// One instant: `predict`, then as many tries of `fit` as one likes, then `learn` from the last of them. Hidden joints
/// go on for a moment, then stay, and go back to rest slowly; joints that hardly turn hardly are turned.
///
/// Allocates in the constructor only. Reads no clock.
class BodyFollower {
 public:
  BodyFollower(const MarkerSet& set, const FollowSettings& settings);

  /// New bone offsets and marker offsets, by bone and by marker.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  bool following() const noexcept { return following_; }
  /// How the body's joints bend stays known: it may be lost, and found again.
  void forget();
  /// It is another body.
  void forget_joints();
  const HingeLeans& leans() const noexcept { return leans_; }
  const BendingPlanes& planes() const noexcept { return planes_; }

  /// A first pose. False, and nobody followed, when too little is seen.
  bool start(std::span<const kinematics::Observation> seen, Timestamp at);

  /// Goes to the pose that the motion leads to at `at`; may be asked for any instant, in any order.
  void predict(Timestamp at);
  /// The pose of the last `predict`, moved to what explains `seen`.
  kinematics::PoseFitResult fit(std::span<const kinematics::Observation> seen);
  /// The same from the pose of the last `fit`, with hidden joints as free as they may be after the time that they are
  /// hidden: what this reading of the markers costs, to be compared with that of another reading. A cost over `within`
  /// may be told as larger than it is: no more work is spent on a reading that cannot come below.
  kinematics::PoseFitResult explain(std::span<const kinematics::Observation> seen, double within = std::numeric_limits<double>::infinity());
  /// A bone turns in its joint until its `marker` is where its marker `onto` was.
  struct Swing {
    int marker = 0;
    int onto = 0;
  };
  /// What `explain` tells, looked for near another pose, by its locals, after these swings (of bones but 0).
  kinematics::PoseFitResult explain_near(std::span<const Pose> locals, std::span<const Swing> swings,
                             std::span<const kinematics::Observation> seen, double within);
  /// Until the next `predict`, these bones (by bone; not 0) may be turned anyhow: they may have followed wrong markers.
  void misread(std::span<const char> bones) { misread_.assign(bones.begin(), bones.end()); }
  /// Takes the last fit for the truth of its instant.
  void learn(std::span<const kinematics::Observation> seen);

  const kinematics::PoseFit& pose() const noexcept { return pose_; }
  /// The local poses of the last `predict`.
  std::span<const Pose> foreseen() const noexcept { return predicted_; }
  double residual_m() const noexcept { return residual_m_; }
  Timestamp learnt_at() const noexcept { return learnt_at_; }

  /// Where the pose at hand puts a marker, with what was learnt about where it sits.
  Eigen::Vector3d told(std::size_t marker) const;
  /// How fast its place moves, m/s.
  double speed_of(std::size_t marker) const { return markers_[marker].moved_m_s.norm(); }
  /// Prepares `told_covariance` for the pose at hand, of which `seen` tells. False when that tells nothing.
  [[nodiscard]] bool weigh(std::span<const kinematics::Observation> seen, Timestamp at);
  /// Of a marker's place by the last `weigh`, m^2; grows with the time that its joints are hidden.
  Eigen::Matrix3d told_covariance(std::size_t marker) const;

  /// Whether `seen` of the last fit told the turn of a bone, by markers that it moves itself (Direct), of which one
  /// camera alone sees any (Ray), or by markers further down.
  enum class Told { No, Further, Ray, Direct };
  Told told_by_markers(std::size_t bone) const { return bones_[bone].told; }
  bool ever_seen(std::size_t marker) const { return markers_[marker].ever_seen; }
  /// Since a marker was last learnt of; a long time where it never was.
  double unseen_s(std::size_t marker, Timestamp at) const;

 private:
  struct MarkerMemory {
    Timestamp seen_at;
    bool ever_seen = false;
    Eigen::Vector3d off_m = Eigen::Vector3d::Zero();    // from where the model puts it, in its bone's frame
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();  // when last learnt
    Eigen::Vector3d moved_m_s = Eigen::Vector3d::Zero();
  };
  struct BoneMemory {
    Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();  // of the local turn, in the parent's frame
    Timestamp whole_at;                                    // when markers told all of its turn
    Told told = Told::No;
    // Which turns in the parent's frame the markers of the last fit told: 1 along an axis that they told alone, 0 along
    // one that they told nothing of.
    Eigen::Matrix3d share = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d share_before = Eigen::Matrix3d::Identity();  // when last learnt
  };

  // A person's joint hardly turns by more than this from set to set against what its motion lets expect, rad.
  static constexpr double kHold_rad = 0.15;

  void see_bones(std::span<const kinematics::Observation> seen);
  void weigh_turns(std::span<const kinematics::Observation> seen);
  kinematics::PosePrior prior_of(std::size_t seen) const;
  kinematics::PoseFitResult solve(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                      double within = std::numeric_limits<double>::infinity());
  kinematics::PoseFitResult explain_at_hand(std::span<const kinematics::Observation> seen, double within);
  kinematics::PoseFitResult solve_held_or_loose(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end);
  kinematics::PoseFitResult bend_back(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                          kinematics::PoseFitResult first);
  bool mirror(std::size_t lower);
  kinematics::PoseFitResult cross_over(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                           kinematics::PoseFitResult first);
  struct Crossing;
  static Crossing crossing_of(const kinematics::Observation& ray, const Eigen::Vector3d& joint, const Eigen::Vector3d& marker);
  bool lay_elsewhere(std::size_t lower, const kinematics::Observation& ray, std::span<const kinematics::Observation> seen, int iterations);
  void weigh_depth(std::size_t marker, const Crossing& crossing, double depth_m);
  bool hangs_free(std::size_t bone) const;
  int limb_on_ray(std::span<const kinematics::Observation> seen, const kinematics::Observation& ray) const;
  void unbend_below(std::size_t lower);
  void swing_to(std::size_t lower, std::size_t marker, const Eigen::Vector3d& place);
  double unheld_cost(std::size_t lower, std::span<const kinematics::Observation> seen, int iterations);
  bool turn_anew(std::span<const kinematics::Observation> seen);
  bool turn_anew(std::size_t bone, std::span<const kinematics::Observation> seen);
  void loosen(std::span<const kinematics::Observation> seen, Timestamp at);

  FollowSettings settings_;
  kinematics::PoseFit pose_;
  NamedLayer layer_;
  bool following_ = false;
  bool refitted_ = false;  // since it last learnt
  Timestamp learnt_at_;
  Timestamp at_;  // of the last predict
  double residual_m_ = 0.0;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
  std::vector<BoneMemory> bones_;
  std::vector<MarkerMemory> markers_;
  std::vector<int> depth_;       // by bone
  std::vector<Pose> learnt_;     // locals
  std::vector<Pose> predicted_;  // locals
  std::vector<Pose> fitted_;     // locals of the last fit
  std::vector<Pose> begun_;      // scratch: locals before a solve
  std::vector<Pose> tried_;      // scratch: locals before a limb is laid anew
  std::vector<Pose> turned_;     // scratch: locals while it is
  std::vector<Pose> unbent_;     // scratch: locals of a limb that hangs on straight
  std::vector<char> below_;      // scratch: by bone
  std::vector<Pose> held_;       // scratch: locals that a limb is held to while it is laid elsewhere
  std::vector<double> off_m2_;   // by bone
  std::vector<int> seen_of_;     // by bone
  HiddenTurns hidden_;
  UsualTurns usual_;
  std::vector<RayDepth> depths_;  // by marker
  HingeLeans leans_;
  BendingPlanes planes_;
  std::vector<double> rest_believed_;  // of this fit, by bone
  std::vector<double> limit_believed_;
  std::vector<Eigen::Matrix3d> hold_weight_;
  std::vector<double> unheld_rest_;  // the same three while a limb is laid elsewhere
  std::vector<double> unheld_limit_;
  std::vector<Eigen::Matrix3d> unheld_weight_;
  struct Weighed {
    int marker = 0;
    bool ray = false;
    bool usable = false;
  };
  std::vector<Weighed> weighed_;  // the observations that `share` of the bones is by
  int weighed_for_ = 0;           // fits
  std::vector<char> misread_;     // by bone
  std::vector<char> bent_back_;   // by bone: in the last fit it was laid elsewhere
  std::vector<geometry::PointPair> pairs_;
};

}  // namespace mocap::pose
