#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "associate/match_settings.h"
#include "associate/predicted/batch_triangulator.h"
#include "associate/predicted/merged_blob_resolver.h"
#include "associate/predicted/prediction_gates.h"
#include "associate/predicted/view_assignments.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/single_view/association_log_odds.h"
#include "base/archive.h"
#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "geometry/ray_quadric.h"

namespace mocap::associate {

/// The first half of matching: assigns the blobs of each view to the predicted markers and triangulates them.
///
/// For each view, gated blobs are assigned to markers by global nearest neighbour (Bar-Shalom and Fortmann 1988): the
/// exact assignment of least total cost. The views of each marker must then agree on one point; outliers are removed.
/// Two views suffice if they are significantly more likely the marker than clutter. A marker seen by one view only
/// becomes a bearing-only observation. The identity of 2D tracks (`Predictions::views`) changes the costs. Never
/// allocates after construction.
class PredictedMatcher {
 public:
  /// `settings` and `error` must outlive this object. A set has at most `camera_count` views.
  PredictedMatcher(const MatchSettings& settings, std::size_t camera_count, RigError& error);

  /// Computes the rays of all views. Appends a match for each predicted marker on which two or more views agree, and
  /// assigns its rays.
  void match(RayTable& rays, const Predictions& predicted, Matches& into);

  /// Appends the predicted markers of the last `match` that have a blob in one view only, if the blob was not assigned
  /// since and is significantly more likely the marker's than clutter. Marks an observation as ambiguous if another
  /// marker is about as likely.
  void append_bearing_only(const RayTable& rays, const Predictions& predicted, Matches& into);

  void archive(Archive& members) { members(set_count_, agreement_.floor_px); }

 private:
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;

  void look_up_identities(const Predictions& predicted, const ViewRays& view, std::size_t index);
  std::uint32_t& tracked_marker(std::size_t view, std::size_t ray) { return tracked_markers_[view * kMaxBlobs + ray]; }
  std::uint32_t tracked_marker(std::size_t view, std::size_t ray) const {
    return tracked_markers_[view * kMaxBlobs + ray];
  }
  bool is_other_markers(const RayTable& rays, std::size_t marker, std::size_t view) const;
  void resolve_two_view(RayTable& rays, std::size_t marker, const PredictedMarker& predicted);
  void assign_by_track(const ViewRays& view, std::size_t index);
  bool is_track_broken(std::size_t view, std::size_t marker) const;
  double track_continuity_cost(std::size_t marker, std::size_t view, std::size_t ray) const;
  bool is_significant_pair(const RayTable& rays, std::size_t marker, const PredictedMarker& predicted) const;
  void retain_likeliest_view(const RayTable& rays, std::size_t marker, const PredictedMarker& predicted);
  std::size_t likeliest_view(const RayTable& rays, std::size_t marker, const PredictedMarker& predicted) const;
  // The other markers that may be the source of a bearing-only observation.
  struct RivalDistribution {
    bool is_empty = true;
    Eigen::Vector3d off_m =
        Eigen::Vector3d::Zero();  // from the prediction of the marker to the mean of all possible markers
    double spread_m = 0.0;        // standard deviation of their predictions, each axis
  };
  RivalDistribution rival_distribution(const ViewRays& view, std::size_t ray, std::size_t marker, double odds,
                                       const Predictions& predicted) const;
  static void shift_bearing(const RivalDistribution& distribution, const PredictedMarker& predicted,
                            BearingOnlyObservation& bearing_only);
  bool assign_view(const ViewRays& view, std::size_t index);
  void assign_unambiguous(std::span<const GateCandidate> candidates, std::size_t index);
  void assign_ambiguous(std::span<const GateCandidate> candidates, std::size_t index);
  void assign_marker(std::span<const GateCandidate> candidates, std::span<const std::uint32_t> candidate_indices,
                     std::size_t index);
  void assign_if_cheaper(const GateCandidate& candidate, double cost);
  void assign_contested(std::span<const GateCandidate> candidates, std::size_t index);
  double cost_of(const GateCandidate& candidate) const;
  const geometry::RayQuadric& shared_quadric(const ViewRays& view, AssignedRay& place);
  void remove_duplicate_assignments();
  std::size_t agree(RayTable& rays, std::size_t marker, const WorldPoint& start);
  bool accept_triangulation(std::size_t marker);
  bool remove_outliers(std::size_t marker);
  void add_sightings(RayTable& rays, std::size_t marker);
  void merge_duplicate_track(RayTable& rays, std::size_t marker);
  bool has_parallax(const RayTable& rays, std::size_t marker) const;
  void use_rays_of_three_views(RayTable& rays) const;
  void search_missing_views(RayTable& rays, std::size_t marker);
  void update_rig_error(const RayTable& rays);
  void update_use_counts(RayTable& rays, std::size_t marker, int change) const;
  std::size_t tracked_view_count(std::size_t marker) const;
  void append_match(const RayTable& rays, std::size_t marker, Matches& into) const;

  const MatchSettings& settings_;
  geometry::Agreement agreement_;
  RigError& error_;
  std::size_t set_count_ = 0;  // number of sets so far
  double max_cos_angle_;
  double gate2_;  // cost of a marker without a ray
  double max_widening_cost_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;
  MergedBlobResolver merged_resolver_;
  PredictionGates gates_;
  BatchTriangulator triangulator_;
  std::size_t camera_count_;
  std::size_t view_count_ = 0;
  std::size_t marker_count_ = 0;
  std::vector<std::uint32_t> column_of_;    // by ray: its column in the assignment problem, or kNone
  std::vector<std::uint32_t> ambiguous_;    // candidates whose marker or ray has other candidates
  std::vector<std::uint32_t> contested_;    // ambiguous candidates that need the assignment solver
  std::vector<std::uint32_t> row_markers_;  // the marker of each row of the assignment problem
  std::vector<std::uint32_t> column_rays_;  // the ray of each column
  // For the view that is being assigned. By ray: the cost of its assignment, and the number of markers for which the
  // ray is the only candidate.
  RayAssignments ray_assignments_;
  std::vector<double> assigned_cost_;
  std::vector<std::uint16_t> sole_candidates_;
  ViewAssignments assignments_;
  std::vector<std::uint32_t> tracked_markers_;  // at view * kMaxBlobs + ray: as BlobIdentities::marker_of_blob
  struct BrokenTrack {
    std::uint32_t view, marker;
  };
  std::vector<BrokenTrack> broken_tracks_;         // bearing-only markers whose 2D track ended
  std::vector<std::uint8_t> has_tracked_markers_;  // by view: whether the marker of any 2D track is known
  std::vector<geometry::RayQuadric> shared_quadrics_;
  std::vector<geometry::Refined> found_;
  std::vector<std::uint32_t> view_counts_;     // by marker: number of views that agree
  std::vector<std::uint8_t> is_triangulated_;  // by marker: whether triangulator_ has exactly its rays
  Sightings sightings_;
  // Copying an empty match is cheaper than value-initialising a match with capacity for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
