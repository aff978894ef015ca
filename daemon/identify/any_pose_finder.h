#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "identify/body_pose_search.h"
#include "kinematics/pose_fit.h"
#include "model/bounds.h"
#include "model/skeleton.h"
#include "pose/point_cloud.h"

namespace mocap::identify {

struct FindAnyPoseSettings {
  BodyUncertainty precise;               ///< first round
  BodyUncertainty coarse{0.007, 0.015};  ///< second round, if the first finds nothing: markers move with the skin
  /// fraction of the markers that must have a point; with fewer, clutter points fit as limbs
  double min_present_fraction = 0.7;
  double min_labelled_fraction = 0.5;  ///< fraction of the markers that must be unambiguous
  /// largest cost of a body, as a fraction of the cost of not detecting any of its markers: with more, the points are
  /// of another body. Bodies that were there had at most 0.50, one that was not had 0.88 (decision 0005)
  double max_cost_fraction = 0.6;
  double max_rms_sigmas = 2.0;  ///< rms distance of the points from the body, in marker sigmas
  /// log likelihood ratio to any hypothesis with another point for a marker; less than a missed detection costs
  double min_cost_margin = 7.0;
  double min_hidden_margin = 5.0;  ///< the same if the marker is not detected and its point is clutter
};

/// An identified body and its pose.
struct FoundPose {
  BoundedVector<int, kMaxLabels> point_of_marker;  ///< index of the point; -1: not detected or ambiguous
  BoundedVector<Pose, kMaxBones> locals;           ///< by bone, in the parent's frame; the root in the world frame
  double rms_m = 0.0;                              ///< of the points from the markers of the body
  double cost = 0.0;                               ///< minus log likelihood, to compare bodies
  int matched = 0;                                 ///< markers with an unambiguous point
  int explained = 0;                               ///< markers with a point, ambiguous or not

  void archive(Archive& members) { members(point_of_marker, locals, rms_m, cost, matched, explained); }
};

/// Finds a body of known bone lengths and marker offsets in any pose, in the points of one instant. Points that are no
/// markers (clutter) and missing markers are allowed.
///
/// 1. The distances between markers of one bone give proposals for a first bone with three markers or more (pelvis,
///    chest, head, feet; a marker in a joint counts for both bones).
/// 2. A beam search (BodyPoseSearch) places the other bones outward along the tree, each on points at the right
///    distances from its joint and from each other, or without any detection.
/// 3. A fit of the whole body with its joint ranges ranks the best hypotheses. If the best misses a marker, step 2
///    visits the limbs once more in the opposite order, and its hypotheses are fitted too (decision 0007).
/// 4. Each limb of the best hypothesis is searched again from its fitted joints: alone; together with the limbs of the
///    same bone, where only exchanges of points between limbs are fitted; and on the points of all markers if one of
///    its own has none (decision 0006). A better alternative replaces the best hypothesis, at most six times.
///
/// A marker gets no point if an alternative of similar cost has another point for it. Alternatives of the last of these
/// searches are excepted. Nothing is found if no bone can start a search, if too few markers have a point, or if cost
/// or rms distance exceed their bounds in FindAnyPoseSettings.
///
/// The search can be spread over several calls. Allocates in the constructor only. Equal points give an equal result.
class AnyPoseFinder {
 public:
  AnyPoseFinder(const MarkerSet& set, const FindAnyPoseSettings& settings);

  /// Takes over fitted bone offsets and marker offsets, by bone and by marker. Ends a running search.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  /// Whether the set has a bone whose markers determine its rotation. Without one, a search finds nothing.
  bool can_find() const noexcept { return !start_bones_.empty(); }
  /// Sets the calibrated hinge axis and the swivel plane of a joint, as pose::SkeletonTracker estimates them.
  void set_hinge(std::size_t bone, const Eigen::Matrix3d& nominal_from_calibrated,
                 const kinematics::SwivelPlane& plane) {
    fit_.set_hinge_axis(bone, nominal_from_calibrated);
    fit_.set_swivel_plane(bone, plane);
  }

  /// Begins a search; ends a running one without result. Uses the first kMaxCloudPoints points.
  void begin(std::span<const Eigen::Vector3d> points);
  /// The same with one round, for a body of this uncertainty.
  void begin(std::span<const Eigen::Vector3d> points, const BodyUncertainty& uncertainty);
  bool searching() const noexcept { return stage_ != Stage::Idle; }
  /// Points of the last `begin`.
  std::size_t point_count() const noexcept { return cloud_.size(); }
  /// Continues the search by about `work` bone fits (about 0.5 us each). Returns true when the search has ended.
  bool advance(std::size_t work);
  /// The result of the last search; empty until that search has ended.
  const std::optional<FoundPose>& found() const noexcept { return found_; }

  /// Searches in one call.
  const std::optional<FoundPose>& find(std::span<const Eigen::Vector3d> points);

  /// Bone fits of the last search so far, to bound the work of a set.
  std::size_t work() const noexcept { return search_.work() - work_at_begin_ + fit_work_; }

  /// Takes over all of another finder, also a search in progress. `before` is not used afterwards.
  void adopt(AnyPoseFinder& before);
  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  enum class Stage { Idle, Search, Fit, ReopenLimb, Alternatives };
  /// A bone at which a search can start.
  struct StartBone {
    int bone = 0;
    SearchPlan plan, reverse;                 // the limbs of each bone in opposite orders
    std::vector<SearchPlan> limbs;            // one limb each, then all limbs that are attached to one bone
    std::size_t single_limbs = 0;             // number of the former
    std::vector<std::size_t> limb_of_marker;  // index in `limbs`; size of the plan: no limb
  };
  /// The fit of the whole body to points.
  struct BodyFit {
    double cost = 0.0, rms_m = 0.0;
    int matched = 0;
    std::vector<int> point_of_marker;
    std::vector<Pose> locals;
  };
  /// A hypothesis and the fit to its points, or to points near the body that fit as well.
  struct Fitted : BodyFit {
    BodyPoseHypothesis hypothesis;

    void archive(Archive& members) { members(hypothesis, cost, rms_m, matched, point_of_marker, locals); }
  };
  using Difference = std::vector<std::pair<int, int>>;  // marker, point

  template <typename Visit>
  void visit_markers(const SearchPlan& limbs, Visit visit) const;
  void find_limbs(StartBone& start) const;
  void refit_search();
  void begin_search();
  void resume_search();
  bool has_valid_indices() const;
  void step();
  bool set_points(std::span<const Eigen::Vector3d> points);
  void begin_round(const BodyUncertainty& uncertainty);
  void search_from_start_bone();
  void choose_fits();
  void select_best();
  void next_start_bone();
  bool is_acceptable(const Fitted& one) const;
  void fit(Fitted& into);
  void solve(BodyFit& into);
  void assign(std::vector<int>& point_of_marker);
  void set_best(Fitted& best);
  const SearchPlan& reopened_limb() const;
  bool may_take_points() const;
  void reopen_limb();
  bool misses_a_marker(const SearchPlan& limb) const;
  void take_points(std::vector<int>& alternative) const;
  bool exchanges_points(std::span<const int> alternative) const;
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
  std::vector<StartBone> start_bones_;  // by descending rank

  pose::PointCloud cloud_;
  Stage stage_ = Stage::Idle;
  BodyUncertainty uncertainty_;
  bool is_last_round_ = false;
  bool is_reverse_ = false;  // second search from the same start bone
  std::size_t start_bone_ = 0, next_ = 0;
  std::size_t limb_ = 0;  // index in `limbs`; then the single limbs again, on the points of all markers
  std::size_t work_at_begin_ = 0, fit_work_ = 0;
  std::vector<Fitted> fitted_;  // hypotheses of the whole body; the first fits_ are valid
  std::size_t fits_ = 0;
  Fitted best_, alternative_;
  BodyFit reassigned_;               // to the points near the body
  BodyPoseHypothesis without_limb_;  // the best hypothesis without the limbs that are searched again
  double best_cost_ = 0.0;
  Difference difference_;
  std::vector<Difference> rejected_differences_;  // each made an alternative to the best hypothesis much worse
  std::size_t rejected_count_ = 0, tried_alternatives_ = 0, improvements_ = 0;
  std::vector<bool> is_ambiguous_;  // by marker
  std::vector<kinematics::Observation> seen_;
  std::vector<geometry::AllowedPair> pairs_;
  std::vector<Pose> locals_;
  std::optional<FoundPose> found_;
};

}  // namespace mocap::identify
