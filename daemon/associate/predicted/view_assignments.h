#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "associate/predicted/ray_assignments.h"
#include "associate/rays/view_rays.h"
#include "model/bounds.h"

namespace mocap::associate {

/// What a view holds of a marker: as little as is asked about all of them.
struct Assignment {
  static constexpr std::uint16_t kNone = 0xFFFF;

  std::uint16_t ray = kNone;
  std::uint16_t shared_place =
      kNone;               ///< number of the place in a blob that is shared; kNone: the blob is the marker's alone
  std::uint16_t blob = 0;  ///< index in the BlobFrame
  bool by_track = false;   ///< the blob's 2D track was this marker's before
  float sigma_px = 0.0F;   ///< of the ray, or of the place

  bool has_ray() const { return ray != kNone; }
  bool is_shared() const { return shared_place != kNone; }
};

/// What all views hold of all expected markers, marker by marker: the views are assigned one after the other, but the
/// questions are asked of each marker over its views. Never allocates after construction.
class ViewAssignments {
 public:
  ViewAssignments(std::size_t max_markers, std::size_t max_views)
      : assignments_(max_markers * max_views), views_(max_markers, 0), use_counts_(max_views * kMaxBlobs, 0) {
    shared_places_.reserve(16 * max_markers);
    released_.reserve(2 * max_markers * max_views);  // what is given up may be found again, once
  }

  /// A set of so many markers and views.
  void begin(std::size_t markers, std::size_t views) {
    marker_count_ = markers;
    view_count_ = views;
    shared_places_.clear();
    released_.clear();
    std::fill_n(views_.begin(), markers, std::uint64_t{0});
    any_shared_ = false;
  }

  /// Takes in what a view holds, and whose each of its rays is by its 2D track. `shared`: some rays have more than one
  /// holder.
  void set_view(std::size_t view, const ViewRays& rays, const RayAssignments& assigned,
                std::span<const std::uint32_t> tracked_marker, bool shared) {
    any_shared_ = any_shared_ || shared;
    std::uint8_t* const use_counts = use_counts_.data() + view * kMaxBlobs;
    std::fill_n(use_counts, rays.size(), std::uint8_t{0});
    const std::span<const std::uint32_t> of_markers = assigned.rays();
    Assignment* to = assignments_.data() + view;
    for (std::uint32_t m = 0; m < marker_count_; ++m, to += view_count_) {
      const std::uint32_t ray = of_markers[m];
      if (ray == AssignedRay::kNone) {
        *to = {};
        continue;
      }
      ++use_counts[ray];
      views_[m] |= std::uint64_t{1} << view;
      *to = assignment_of(rays, ray, tracked_marker[ray] == m);
    }
    for (std::size_t i = 0; i < assigned.shared_markers().size() && shared_places_.size() < shared_places_.capacity();
         ++i) {
      Assignment& assignment = assignments_[assigned.shared_markers()[i] * view_count_ + view];
      assignment.shared_place = static_cast<std::uint16_t>(shared_places_.size());
      assignment.sigma_px = assigned.shared_places()[i].sigma_px;
      shared_places_.push_back(assigned.shared_places()[i]);
    }
  }

  const Assignment& operator()(std::size_t marker, std::size_t view) const {
    return assignments_[marker * view_count_ + view];
  }
  /// All of a marker's, by view.
  std::span<const Assignment> of(std::size_t marker) const {
    return std::span(assignments_).subspan(marker * view_count_, view_count_);
  }
  /// The views that hold a ray of a marker, a bit each.
  std::uint64_t views(std::size_t marker) const { return views_[marker]; }
  /// What is known of a place that is shared.
  AssignedRay& shared_place(const Assignment& assignment) { return shared_places_[assignment.shared_place]; }
  const AssignedRay& shared_place(const Assignment& assignment) const {
    return shared_places_[assignment.shared_place];
  }
  /// All that is known.
  AssignedRay assigned(std::size_t marker, std::size_t view) const {
    const Assignment& assignment = (*this)(marker, view);
    if (assignment.is_shared()) return shared_place(assignment);
    AssignedRay assigned;
    if (assignment.has_ray()) assigned.ray = assignment.ray;
    return assigned;
  }

  void unassign(std::size_t marker, std::size_t view) {
    Assignment& assignment = assignments_[marker * view_count_ + view];
    if (!assignment.has_ray()) return;
    if (released_.size() < released_.capacity())
      released_.push_back({static_cast<std::uint16_t>(view), assignment.ray});
    clear(marker, view);
  }
  /// The marker has the whole ray.
  void assign(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray, bool by_track) {
    assignments_[marker * view_count_ + view] = assignment_of(rays, ray, by_track);
    views_[marker] |= std::uint64_t{1} << view;
  }
  /// The first marker has what the second had, where that had anything; `by_track`: by its 2D track.
  void transfer(std::size_t to, std::size_t from, std::size_t view, bool by_track) {
    Assignment& given = assignments_[from * view_count_ + view];
    if (!given.has_ray()) return;
    given.by_track = by_track;
    assignments_[to * view_count_ + view] = given;
    views_[to] |= std::uint64_t{1} << view;
    clear(from, view);
  }

  bool any_shared() const { return any_shared_; }
  /// Of a set's rays those that a marker gave up since they were taken in, by `unassign`.
  struct ReleasedRay {
    std::uint16_t view, ray;
  };
  std::span<const ReleasedRay> released() const { return released_; }
  /// How many markers held each ray of a view when it was taken in, without those that forsook it.
  std::span<const std::uint8_t> use_counts(std::size_t view) const {
    return std::span(use_counts_).subspan(view * kMaxBlobs, kMaxBlobs);
  }
  /// Whether one marker alone holds the ray.
  bool is_exclusive(std::size_t view, std::size_t ray) const {
    return !any_shared_ || use_counts_[view * kMaxBlobs + ray] == 1;
  }
  /// Whether a view shows this marker and no other.
  bool has_exclusive_ray(std::size_t marker) const {
    const std::span<const Assignment> views = of(marker);
    for (std::size_t view = 0; view < views.size(); ++view) {
      if (views[view].has_ray() && is_exclusive(view, views[view].ray)) return true;
    }
    return false;
  }
  /// A marker leaves all its rays to the others that hold them.
  void release_all(std::size_t marker) {
    for (std::uint64_t views = views_[marker]; views != 0; views &= views - 1) {
      const auto view = static_cast<std::size_t>(std::countr_zero(views));
      --use_counts_[view * kMaxBlobs + (*this)(marker, view).ray];
      clear(marker, view);
    }
  }

 private:
  void clear(std::size_t marker, std::size_t view) {
    assignments_[marker * view_count_ + view] = {};
    views_[marker] &= ~(std::uint64_t{1} << view);
  }
  static Assignment assignment_of(const ViewRays& rays, std::size_t ray, bool by_track) {
    return {static_cast<std::uint16_t>(ray), Assignment::kNone, rays.blob[ray], by_track, rays.sigma_f[ray]};
  }

  std::size_t marker_count_ = 0;
  std::size_t view_count_ = 0;
  bool any_shared_ = false;
  std::vector<Assignment> assignments_;     // of marker * view count + view
  std::vector<std::uint64_t> views_;        // by marker: which hold a ray of it
  std::vector<AssignedRay> shared_places_;  // that are shared
  std::vector<ReleasedRay> released_;
  std::vector<std::uint8_t> use_counts_;  // of view * kMaxBlobs + ray: how many markers hold it
};

}  // namespace mocap::associate
