#pragma once

#include <vector>

#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "geometry/triangulation.h"
#include "stages/match_views.h"
#include "stages/share_blobs.h"
#include "stages/view_rays.h"

namespace mocap::stages {

/// The first half of matching: finds the blobs of markers whose place is known. Never allocates after construction.
class ExpectedMatcher {
 public:
  /// `settings` must outlive it; `camera_count` views a set at most.
  ExpectedMatcher(const MatchSettings& settings, std::size_t camera_count);

  /// Appends a match for each expected marker that two or more views agree on, and takes its rays.
  void match(RayTable& rays, const Expected& expected, Matches& into);

  /// Appends the expected markers of the last `match` that one view alone has, where nothing else took their blob
  /// since.
  void list_lone(const RayTable& rays, Matches& into) const;

 private:
  using Sightings = BoundedVector<geometry::Sighting, kMaxCameras>;

  void forsake_doubles(const RayTable& rays);
  bool has_own_ray(std::size_t marker) const;
  std::uint8_t& holders(std::size_t view, std::uint32_t ray) { return holders_[view * kMaxBlobs + ray]; }
  std::uint8_t holders(std::size_t view, std::uint32_t ray) const { return holders_[view * kMaxBlobs + ray]; }
  void assign_view(const ViewRays& view, std::size_t index, const Expected& expected);
  Held& held(std::size_t marker, std::size_t view) { return held_[view * marker_count_ + marker]; }
  const Held& held(std::size_t marker, std::size_t view) const { return held_[view * marker_count_ + marker]; }
  std::size_t agree(const RayTable& rays, std::size_t marker);
  bool tell_depth(const RayTable& rays, std::size_t marker) const;
  void recover(RayTable& rays, std::size_t marker);
  void mark(RayTable& rays, std::size_t marker, int change) const;
  void give(const RayTable& rays, std::size_t marker, Matches& into) const;

  const MatchSettings& settings_;
  geometry::Agreement agreement_;
  double max_cos_angle_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;
  BlobSharer sharer_;
  std::size_t view_count_ = 0;
  std::size_t marker_count_ = 0;
  std::vector<Foreseen> foreseen_;     // by marker, in the view that is being assigned
  std::vector<Held> held_;             // of view * marker count + marker
  std::vector<std::uint8_t> holders_;  // of view * kMaxBlobs + ray: how many markers hold it
  std::vector<geometry::Refined> found_;
  std::vector<std::uint32_t> views_of_;  // how many views of each marker agree
  Sightings sightings_;
};

}  // namespace mocap::stages
