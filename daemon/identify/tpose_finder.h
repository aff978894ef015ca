#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "geometry/rigid_fit.h"
#include "kinematics/pose_fit.h"
#include "model/bounds.h"
#include "model/points.h"
#include "model/skeleton.h"

namespace mocap::identify {

struct FindSettings {
  double min_scale = 0.75;  ///< size of the body relative to the marker set
  double max_scale = 1.25;
  double min_marker_fraction = 0.85;  ///< fraction of the markers that must have a point
  double max_rms_m = 0.02;            ///< of the points from the markers of the fitted body
  /// largest cost of the markers with a point, outliers included, as a fraction of the cost of not detecting them: with
  /// more, the points are of another body. True bodies had at most 0.21, wrong ones at least 0.50 (decision 0005)
  double max_cost_fraction = 0.4;
  double min_margin = 8.0;           ///< log likelihood ratio of the best to the next best hypothesis
  double max_joint_angle_rad = 3.2;  ///< largest rotation of a joint from the rest pose; 3.2: no limit
};

/// An identified body and its fitted dimensions.
struct FoundBody {
  BoundedVector<int, kMaxLabels> point_of_marker;               ///< index of the point; -1: not detected
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;     ///< fitted, by bone
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;  ///< fitted, by marker
  double rms_m = 0.0;                                           ///< of the points from the markers of the fitted body
  double margin = 0.0;                                          ///< cost of the next best hypothesis minus the cost
  int matched = 0;                                              ///< markers with a point
};

/// The end of a search for a rest pose.
enum class TPoseOutcome {
  TooFewPoints,  ///< fewer than min_marker_fraction of the markers, or a set of fewer than four
  NoPlacement,   ///< no pair of points is as far apart as hands or elbows
  TooFewMatched,
  TooInexact,  ///< the rms distance exceeds max_rms_m, or the cost max_cost_fraction
  Ambiguous,   ///< the margin is below min_margin or a quarter of the cost, or asymmetric pairs are exchanged
  BentJoints,  ///< joints deviate too much from the pose
  Found,
};

/// The best hypothesis of a search, found or not.
struct TPoseAttempt {
  TPoseOutcome outcome = TPoseOutcome::TooFewPoints;
  int matched = 0;     ///< markers with a point
  double rms_m = 0.0;  ///< of these points and the outliers from the markers of the fitted body
  BoundedVector<int, kMaxLabels> point_of_marker;  ///< -1: no point; empty: no hypothesis
  BoundedVector<WorldPoint, kMaxLabels> expected;  ///< by marker: in rest pose at the upright placement
};

/// Finds a person of unknown dimensions in the rest pose of the marker set, in the points of one instant. The rest pose
/// is the T-pose, or another pose (calibration_pose.h). The person stands upright with any heading and any size; bone
/// lengths differ from the set, markers may be missing, and points may be clutter.
///
/// Pairs of distant markers (hands, elbows) propose placements of the body. The markers of each of the best placements
/// are moved towards the points around them, and a fit of the whole body with free bone lengths gives the cost. The
/// differences between front and back determine the heading.
///
/// Nothing is found if the body rotated by half a turn fits about as well, or if the two markers of the asymmetric
/// pairs of the set are exchanged in the best hypothesis.
///
/// Allocates in the constructor only.
class TPoseFinder {
 public:
  /// A call of find() uses the first `max_points` points.
  TPoseFinder(const MarkerSet& set, FindSettings settings, std::size_t max_points);

  const std::optional<FoundBody>& find(std::span<const Eigen::Vector3d> points);

  /// The best hypothesis of the last call of find(): the reason of a failure.
  const TPoseAttempt& attempt() const noexcept { return attempt_; }

 private:
  struct Proposal {
    geometry::UprightFit place;
    double score = 0.0;
  };
  struct Hypothesis {
    std::vector<int> point_of_marker;
    geometry::UprightFit place;
    double cost = 0.0;
    double rms_m = 0.0;
    int matched = 0;
    bool sides_swapped = false;  // the asymmetric pairs are exchanged
  };
  struct Asymmetry {
    MarkerPair pair;
    Eigen::Vector3d off_m;
  };

  void propose(std::span<const Eigen::Vector3d> points);
  void keep_best(const Proposal& proposal);
  double score(const geometry::UprightFit& place, std::span<const Eigen::Vector3d> points) const;
  void evaluate_placement(const geometry::UprightFit& place, std::span<const Eigen::Vector3d> points, Hypothesis& into);
  void assign(std::span<const Eigen::Vector3d> points, double gate_m, Hypothesis& into);
  void warp_model(std::span<const Eigen::Vector3d> points, double reach_m, Hypothesis& into);
  void remove_outliers(std::span<const Eigen::Vector3d> points, Hypothesis& into);
  void fit_body(std::span<const Eigen::Vector3d> points, Hypothesis& into);
  bool has_swapped_sides(std::span<const Eigen::Vector3d> points, const Hypothesis& hypothesis) const;
  bool shares_points(const Hypothesis& a, const Hypothesis& b) const;
  bool is_in_pose() const;
  TPoseOutcome judge(const Hypothesis& best, double margin) const;
  void describe_attempt(const Hypothesis& best);
  void describe(const Hypothesis& best, std::span<const Eigen::Vector3d> points, double margin);

  FindSettings settings_;
  std::size_t max_points_;
  kinematics::PoseFit fit_;
  geometry::Assigner assigner_;
  std::vector<Eigen::Vector3d> model_;  // markers in rest pose, root at the origin
  std::vector<Asymmetry> asymmetries_;
  std::vector<std::pair<int, int>> anchors_;
  BoundedVector<Proposal, 4> proposals_;
  std::vector<Hypothesis> hypotheses_;
  std::vector<Eigen::Vector3d> warped_;  // expected positions of the markers, in the world frame
  std::vector<geometry::AllowedPair> pairs_;
  std::vector<geometry::PointPair> matched_;
  std::vector<kinematics::Observation> seen_;
  std::vector<double> prior_sigma_rad_;
  std::optional<FoundBody> found_;
  TPoseAttempt attempt_;
};

}  // namespace mocap::identify
