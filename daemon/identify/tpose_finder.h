#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "geometry/rigid_fit.h"
#include "kinematics/pose_fit.h"
#include "model/bounds.h"
#include "model/skeleton.h"

namespace mocap::identify {

struct FindSettings {
  double min_scale = 0.75;  ///< of the body against the file's
  double max_scale = 1.25;
  double min_marker_fraction = 0.85;  ///< of the markers that must be there
  double max_rms_m = 0.02;            ///< of the markers from the fitted body
  double min_margin = 8.0;            ///< by how much of log-likelihood the next best reading must be worse
  double max_joint_angle_rad = 3.2;   ///< of a joint from the pose; where one is turned further it is another pose
};

/// A body found among points.
struct FoundBody {
  BoundedVector<int, kMaxLabels> point_of_marker;               ///< index of the point, -1: not there
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;     ///< fitted, by bone
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;  ///< fitted, by marker
  double rms_m = 0.0;                                           ///< of the markers from the fitted body
  double margin = 0.0;                                          ///< log-likelihood over the next best reading
  int matched = 0;
};

/// Finds a person in T-pose, or the pose that is its set's rest pose (body/stance.h), among points that hold still:
/// upright, any heading, any size, bones of other lengths than the file's, some markers missing, some points that are
/// no markers.
///
/// Wide pairs of markers (hands, elbows) propose where the body could stand; the best proposals are bent to the points
/// and then judged by the fit of a whole body with free bone lengths. Which way it faces is told by what differs front
/// from back; when the turned reading fits about as well, nothing is found rather than guessed. Nor is anything where
/// the best reading has the two of the set's asymmetric pairs exchanged, however well it fits.
///
/// Allocates in the constructor only.
class TPoseFinder {
 public:
  /// `max_points` at most are looked at in one call; more are cut off.
  TPoseFinder(const MarkerSet& set, FindSettings settings, std::size_t max_points);

  const std::optional<FoundBody>& find(std::span<const Eigen::Vector3d> points);

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
    bool sides_swapped = false;  // by the asymmetric pairs
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
  std::vector<Eigen::Vector3d> warped_;  // where the markers are looked for
  std::vector<geometry::AllowedPair> pairs_;
  std::vector<geometry::PointPair> matched_;
  std::vector<kinematics::Observation> seen_;
  std::vector<double> prior_sigma_rad_;
  std::optional<FoundBody> found_;
};

}  // namespace mocap::identify
