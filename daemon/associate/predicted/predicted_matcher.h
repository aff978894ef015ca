#pragma once

#include <span>
#include <vector>

#include "associate/multi_view_matcher.h"
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
class ExpectedMatcher {
 public:
  /// `settings` and `error` must outlive it; `camera_count` views a set at most.
  ExpectedMatcher(const MatchSettings& settings, std::size_t camera_count, RigError& error);

  /// Casts the rays of all views, appends a match for each expected marker that two or more views agree on, and takes
  /// its rays.
  void match(const FrameSet& frames, RayTable& rays, const Expected& expected, Matches& into);

  /// Appends the expected markers of the last `match` that one view alone has, where nothing else took their blob
  /// since, and where it is hardly another's. Who is clearly the only one that it may be keeps its 2D track.
  void list_lone(const FrameSet& frames, const RayTable& rays, const Expected& expected, Matches& into);

 private:
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;

  void find_owners(const BlobFrame& frame, const ViewRays& view, std::size_t index);
  std::uint32_t& owner(std::size_t view, std::size_t ray) { return owner_[view * kMaxBlobs + ray]; }
  std::uint32_t owner(std::size_t view, std::size_t ray) const { return owner_[view * kMaxBlobs + ray]; }
  bool is_others(const RayTable& rays, std::size_t marker, std::size_t view) const;
  void settle_pair(RayTable& rays, std::size_t marker, const ExpectedMarker& expected);
  void claim_own(const ViewRays& view, std::size_t index);
  bool is_broken(std::size_t view, std::size_t marker) const;
  double odds_of_owner(std::size_t marker, std::size_t view, std::size_t ray) const;
  bool is_believed(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) const;
  void keep_own(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected);
  std::size_t likely_view(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) const;
  void learn_owners(const FrameSet& frames, const RayTable& rays);
  // What else may have made a marker's lone blob.
  struct Rivals {
    bool none = true;
    Eigen::Vector3d off_m = Eigen::Vector3d::Zero();  // from the marker's place to the mean of all that may be
    double spread_m = 0.0;                            // of their places about it, each axis
  };
  Rivals rivals_of(const ViewRays& view, std::size_t ray, std::size_t marker, double odds,
                   const Expected& expected) const;
  static void put_aside(const Rivals& rivals, const ExpectedMarker& expected, LoneSighting& lone);
  bool assign_view(const ViewRays& view, std::size_t index);
  void assign_the_alone(std::span<const GateCandidate> candidates, std::size_t index);
  void assign_several(std::span<const GateCandidate> candidates, std::size_t index);
  void assign_marker(std::span<const GateCandidate> candidates, std::span<const std::uint32_t> wanted,
                     std::size_t index);
  void offer(const GateCandidate& candidate, double cost);
  void assign_contested(std::span<const GateCandidate> candidates, std::size_t index);
  double cost_of(const GateCandidate& candidate) const;
  const geometry::RayQuadric& shared_quadric(const ViewRays& view, Held& place);
  void forsake_doubles();
  std::size_t agree(RayTable& rays, std::size_t marker, const WorldPoint& start);
  bool take_meeting(std::size_t marker);
  bool leave_out_worst(std::size_t marker);
  void add_sightings(RayTable& rays, std::size_t marker);
  void join_older(RayTable& rays, std::size_t marker);
  bool tell_depth(const RayTable& rays, std::size_t marker) const;
  void take_sure(RayTable& rays) const;
  void recover(RayTable& rays, std::size_t marker);
  void learn_error(const RayTable& rays);
  void mark(RayTable& rays, std::size_t marker, int change) const;
  std::size_t own_views(std::size_t marker) const;
  void give(const RayTable& rays, std::size_t marker, Matches& into) const;

  const MatchSettings& settings_;
  geometry::Agreement agreement_;
  RigError& error_;
  std::size_t turn_ = 0;  // counts the sets
  double max_cos_angle_;
  double gate2_;  // what it costs to hold no ray
  double widest_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;
  BlobSharer sharer_;
  ExpectedGates gates_;
  BlobOwners owners_;
  MeetingPoints meetings_;
  std::size_t camera_count_;
  std::size_t view_count_ = 0;
  std::size_t marker_count_ = 0;
  std::vector<std::uint32_t> column_of_;    // by ray: its column among the contested, or kNone
  std::vector<std::uint32_t> several_;      // candidates that are not alone
  std::vector<std::uint32_t> contested_;    // of these, those that need the assigner
  std::vector<std::uint32_t> row_markers_;  // of the contested: the marker of each row
  std::vector<std::uint32_t> column_rays_;  // and the ray of each column
  // Of the view that is being assigned. By marker: what it holds; by ray: who holds it and at what cost, and how many
  // want it who want nothing else.
  ViewHolds view_holds_;
  std::vector<double> holder_cost_;
  std::vector<std::uint16_t> faithful_;
  HeldViews held_;
  std::vector<std::uint32_t> owner_;  // of view * kMaxBlobs + ray: as BlobOwners has it
  struct Broken {
    std::uint32_t view, marker;
  };
  std::vector<Broken> broken_;            // whose 2D tracks broke in views that alone saw them
  std::vector<std::uint8_t> has_owners_;  // by view: whether any is known
  std::vector<geometry::RayQuadric> shared_quadrics_;
  std::vector<geometry::Refined> found_;
  std::vector<std::uint32_t> views_of_;  // how many views of each marker agree
  std::vector<std::uint8_t> met_;        // whether the meetings have just those rays of each marker
  Sightings sightings_;
  // A copy costs what is in it; one made from nothing is cleared as a whole, with the room for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
