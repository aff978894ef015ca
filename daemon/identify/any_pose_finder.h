#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "identify/body_pose_search.h"
#include "kinematics/pose_fit.h"
#include "model/bounds.h"
#include "model/skeleton.h"
#include "pose/point_cloud.h"

namespace mocap::identify {

struct FindAnyPoseSettings {
  BodyUncertainty precise;               ///< tried first: what fits so is soon clear
  BodyUncertainty coarse{0.007, 0.015};  ///< then this: skin that slides
  double min_present_fraction =
      0.7;  ///< share of the markers that must be there; of fewer, ghosts make limbs too easily
  double min_labelled_fraction = 0.5;  ///< and that must be named
  double max_rms_sigmas = 2.0;         ///< of the markers from the body, in their sigmas
  double min_cost_margin = 10.0;       ///< by how much of log-likelihood another reading of a marker must be worse
  double min_hidden_margin = 5.0;      ///< and that it is hidden, and its point a stray
};

/// A body found in a pose.
struct FoundPose {
  BoundedVector<int, kMaxLabels> point_of_marker;  ///< index of the point, -1: not there, or not sure which
  BoundedVector<Pose, kMaxBones> locals;           ///< by bone, from the parent's frame; the root's from the world
  double rms_m = 0.0;                              ///< of the markers from the body
  double cost = 0.0;                               ///< minus log-likelihood, for comparison with others
  double margin = 0.0;                             ///< to the next best reading
  int matched = 0;                                 ///< markers that are named
  int explained = 0;                               ///< markers that have a point, sure or not
};

/// Finds a body whose measures are known among the points of one instant, in any pose, among points that are no
/// markers and with markers missing.
///
/// Bones that have three markers or more (pelvis, chest, head, feet; a marker in a joint counts for both bones) are
/// looked for by their distances. From each place where one may be the tree is laid outwards, bone by bone, on the
/// points that have the right distances from the joint and from each other; many readings are followed at once, the
/// likeliest, among them that a bone is not seen at all. The best are judged by the fit of the whole body with its
/// joints' ranges. Then the limbs of the best are laid anew from where the whole body has their joints, and each other
/// reading of them challenges it. A marker is named where all readings that are about as likely agree; where that is
/// too few, nothing is found.
///
/// The work can be spread over several calls. Allocates in the constructor only. The same points give the same answer.
class AnyPoseFinder {
 public:
  AnyPoseFinder(const MarkerSet& set, const FindAnyPoseSettings& settings);

  /// New bone offsets and marker offsets, by bone and by marker.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  /// Whether the set has a bone to begin with.
  bool can_find() const noexcept { return !roots_.empty(); }
  /// How a joint of this body bends, as SkeletonTracker learnt it.
  void set_hinge(std::size_t bone, const Eigen::Matrix3d& nominal_from_calibrated,
                 const kinematics::SwivelPlane& plane) {
    fit_.set_hinge_axis(bone, nominal_from_calibrated);
    fit_.set_swivel_plane(bone, plane);
  }

  /// Begins a search; one that goes on is given up. At most kMaxCloudPoints are looked at.
  void begin(std::span<const Eigen::Vector3d> points);
  bool searching() const noexcept { return stage_ != Stage::Idle; }
  /// Goes on by about as many bone fits (half a microsecond each) as `work`; true when the search has ended.
  bool advance(std::size_t work);
  /// What the search that ended has found.
  const std::optional<FoundPose>& found() const noexcept { return found_; }

  /// All at once.
  const std::optional<FoundPose>& find(std::span<const Eigen::Vector3d> points);

  /// Bone fits of the last search, for those who plan.
  std::size_t work() const noexcept { return search_.work() - work_at_begin_ + fit_work_; }

 private:
  enum class Stage { Idle, Search, Fit, ReopenLimb, Alternatives };
  /// Where a search can begin.
  struct Root {
    int bone = 0;
    SearchPlan plan;
    std::vector<SearchPlan> limbs;  // that hang on one bone each
  };
  /// A reading and the whole body that was fitted to it.
  struct Fitted {
    BodyPoseHypothesis hypothesis;
    double cost = 0.0, rms_m = 0.0;
    int matched = 0;
    std::vector<int> point_of_marker;
    std::vector<Pose> locals;
  };
  using Difference = std::vector<std::pair<int, int>>;  // marker, point

  std::vector<SearchPlan> limbs_of(int root, const SearchPlan& plan) const;
  void step();
  void begin_round(const BodyUncertainty& uncertainty);
  void choose_fits();
  void select_best();
  void advance_root();
  bool is_acceptable(const Fitted& one) const;
  void fit(Fitted& into);
  void solve(Fitted& into, int iterations);
  void assign(Fitted& into);
  void reopen_limb();
  void begin_alternatives();
  void evaluate_alternative();
  bool find_differences(std::span<const int> alternative);
  bool is_rejected() const;
  void mark_ambiguous();
  void describe();

  FindAnyPoseSettings settings_;
  MarkerSet set_;
  BodyPoseSearch search_;
  kinematics::PoseFit fit_;
  geometry::Assigner assigner_;
  std::vector<Root> roots_;  // the best first

  pose::PointCloud cloud_;
  Stage stage_ = Stage::Idle;
  BodyUncertainty uncertainty_;
  bool is_coarse_ = false;  // the second round
  std::size_t root_ = 0, next_ = 0, limb_ = 0;
  std::size_t work_at_begin_ = 0, fit_work_ = 0;
  std::vector<Fitted> fitted_;  // rivals for the whole body
  std::size_t fits_ = 0;
  Fitted best_, alternative_;
  BodyPoseHypothesis without_limb_;  // the best without the limbs that are laid anew
  double best_cost_ = 0.0;
  Difference difference_;
  std::vector<Difference> rejected_differences_;  // what made a rival much worse
  std::size_t rejected_count_ = 0, tried_alternatives_ = 0, improvements_ = 0;
  std::vector<bool> is_ambiguous_;  // by marker
  double margin_ = 0.0;
  std::vector<kinematics::Observation> seen_;
  std::vector<geometry::AllowedPair> pairs_;
  std::vector<Pose> locals_;
  std::optional<FoundPose> found_;
};

}  // namespace mocap::identify
