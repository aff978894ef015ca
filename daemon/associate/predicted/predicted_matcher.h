#pragma once

#include <span>
#include <vector>

#include "associate/match_settings.h"
#include "associate/predicted/batch_triangulator.h"
#include "associate/predicted/blob_track_owners.h"
#include "associate/predicted/merged_blob_resolver.h"
#include "associate/predicted/prediction_gates.h"
#include "associate/predicted/view_assignments.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/single_view/association_log_odds.h"
#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "geometry/ray_quadric.h"

namespace mocap::associate {

/// The first half of matching: finds the blobs of markers whose place is known. Never allocates after construction.
class PredictedMatcher {
 public:
  /// `settings` and `error` must outlive it; `camera_count` views a set at most.
  PredictedMatcher(const MatchSettings& settings, std::size_t camera_count, RigError& error);

  /// Casts the rays of all views, appends a match for each expected marker that two or more views agree on, and takes
  /// its rays.
  void match(const FrameSet& frames, RayTable& rays, const Expected& expected, Matches& into);

  /// Appends the expected markers of the last `match` that one view alone has, where nothing else took their blob
  /// since, and where it is hardly another's. Who is clearly the only one that it may be keeps its 2D track.
  void append_bearing_only(const FrameSet& frames, const RayTable& rays, const Expected& expected, Matches& into);

 private:
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;

  void look_up_owners(const BlobFrame& frame, const ViewRays& view, std::size_t index);
  std::uint32_t& tracked_marker(std::size_t view, std::size_t ray) { return tracked_markers_[view * kMaxBlobs + ray]; }
  std::uint32_t tracked_marker(std::size_t view, std::size_t ray) const {
    return tracked_markers_[view * kMaxBlobs + ray];
  }
  bool is_other_markers(const RayTable& rays, std::size_t marker, std::size_t view) const;
  void resolve_two_view(RayTable& rays, std::size_t marker, const ExpectedMarker& expected);
  void assign_by_track(const ViewRays& view, std::size_t index);
  bool is_track_broken(std::size_t view, std::size_t marker) const;
  double track_continuity_cost(std::size_t marker, std::size_t view, std::size_t ray) const;
  bool is_significant_pair(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) const;
  void retain_likeliest_view(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected);
  std::size_t likeliest_view(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) const;
  void update_owners(const FrameSet& frames, const RayTable& rays);
  // What else may have made a marker's lone blob.
  struct RivalDistribution {
    bool is_empty = true;
    Eigen::Vector3d off_m = Eigen::Vector3d::Zero();  // from the marker's place to the mean of all that may be
    double spread_m = 0.0;                            // of their places about it, each axis
  };
  RivalDistribution rival_distribution(const ViewRays& view, std::size_t ray, std::size_t marker, double odds,
                                       const Expected& expected) const;
  static void shift_bearing(const RivalDistribution& distribution, const ExpectedMarker& expected,
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
  void take_rays_of_sure(RayTable& rays) const;
  void search_missing_views(RayTable& rays, std::size_t marker);
  void update_rig_error(const RayTable& rays);
  void update_use_counts(RayTable& rays, std::size_t marker, int change) const;
  std::size_t tracked_view_count(std::size_t marker) const;
  void append_match(const RayTable& rays, std::size_t marker, Matches& into) const;

  const MatchSettings& settings_;
  geometry::Agreement agreement_;
  RigError& error_;
  std::size_t set_count_ = 0;  // counts the sets
  double max_cos_angle_;
  double gate2_;  // what it costs to hold no ray
  double max_widening_cost_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;
  MergedBlobResolver merged_resolver_;
  PredictionGates gates_;
  BlobTrackOwners blob_tracks_;
  BatchTriangulator triangulator_;
  std::size_t camera_count_;
  std::size_t view_count_ = 0;
  std::size_t marker_count_ = 0;
  std::vector<std::uint32_t> column_of_;    // by ray: its column among the contested, or kNone
  std::vector<std::uint32_t> ambiguous_;    // candidates that are not alone
  std::vector<std::uint32_t> contested_;    // of these, those that need the assigner
  std::vector<std::uint32_t> row_markers_;  // of the contested: the marker of each row
  std::vector<std::uint32_t> column_rays_;  // and the ray of each column
  // Of the view that is being assigned. By marker: what it holds; by ray: who holds it and at what cost, and how many
  // want it who want nothing else.
  RayAssignments ray_assignments_;
  std::vector<double> assigned_cost_;
  std::vector<std::uint16_t> sole_candidates_;
  ViewAssignments assignments_;
  std::vector<std::uint32_t> tracked_markers_;  // of view * kMaxBlobs + ray: as BlobTrackOwners has it
  struct BrokenTrack {
    std::uint32_t view, marker;
  };
  std::vector<BrokenTrack> broken_tracks_;         // whose 2D tracks broke in views that alone saw them
  std::vector<std::uint8_t> has_tracked_markers_;  // by view: whether any is known
  std::vector<geometry::RayQuadric> shared_quadrics_;
  std::vector<geometry::Refined> found_;
  std::vector<std::uint32_t> view_counts_;     // how many views of each marker agree
  std::vector<std::uint8_t> is_triangulated_;  // whether the meetings have just those rays of each marker
  Sightings sightings_;
  // A copy costs what is in it; one made from nothing is cleared as a whole, with the room for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
