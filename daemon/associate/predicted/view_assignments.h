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

/// The assignment of one view to one marker. Compact, because the matcher reads all assignments often.
struct Assignment {
  static constexpr std::uint16_t kNone = 0xFFFF;

  std::uint16_t ray = kNone;
  std::uint16_t shared_place = kNone;  ///< index of the position in a shared blob; kNone: the blob is not shared
  std::uint16_t blob = 0;              ///< index in the BlobFrame
  bool by_track = false;               ///< the 2D track of the blob is established as this marker's
  float sigma_px = 0.0F;               ///< of the ray, or of the position in the shared blob

  bool has_ray() const { return ray != kNone; }
  bool is_shared() const { return shared_place != kNone; }
};

/// The assignments of all views to all predicted markers, stored marker by marker: the views are assigned one after
/// another, but later steps read all views of one marker. Never allocates after construction.
class ViewAssignments {
 public:
  ViewAssignments(std::size_t max_markers, std::size_t max_views)
      : assignments_(max_markers * max_views), views_(max_markers, 0), use_counts_(max_views * kMaxBlobs, 0) {
    shared_places_.reserve(16 * max_markers);
    released_.reserve(2 * max_markers * max_views);  // a released ray may be assigned and released again
  }

  /// Begins a set with this number of markers and views.
  void begin(std::size_t markers, std::size_t views) {
    marker_count_ = markers;
    view_count_ = views;
    shared_places_.clear();
    released_.clear();
    std::fill_n(views_.begin(), markers, std::uint64_t{0});
    any_shared_ = false;
  }

  /// Stores the assignments of one view. `tracked_marker`: by ray, the marker that its 2D track is established as.
  /// `shared`: whether any ray belongs to several markers.
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
  /// The assignments of a marker, by view.
  std::span<const Assignment> of(std::size_t marker) const {
    return std::span(assignments_).subspan(marker * view_count_, view_count_);
  }
  /// The views that have a ray of a marker, one bit each.
  std::uint64_t views(std::size_t marker) const { return views_[marker]; }
  /// The position in a shared blob. Precondition: the assignment is shared.
  AssignedRay& shared_place(const Assignment& assignment) { return shared_places_[assignment.shared_place]; }
  const AssignedRay& shared_place(const Assignment& assignment) const {
    return shared_places_[assignment.shared_place];
  }
  /// The assignment with the position in a shared blob.
  AssignedRay assigned(std::size_t marker, std::size_t view) const {
    const Assignment& assignment = (*this)(marker, view);
    if (assignment.is_shared()) return shared_place(assignment);
    AssignedRay assigned;
    if (assignment.has_ray()) assigned.ray = assignment.ray;
    return assigned;
  }

  /// Removes an assignment and records it in released().
  void unassign(std::size_t marker, std::size_t view) {
    Assignment& assignment = assignments_[marker * view_count_ + view];
    if (!assignment.has_ray()) return;
    if (released_.size() < released_.capacity())
      released_.push_back({static_cast<std::uint16_t>(view), assignment.ray});
    clear(marker, view);
  }
  /// Assigns an exclusive ray.
  void assign(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray, bool by_track) {
    assignments_[marker * view_count_ + view] = assignment_of(rays, ray, by_track);
    views_[marker] |= std::uint64_t{1} << view;
  }
  /// Moves the assignment of marker `from`, if there is one, to marker `to`.
  void transfer(std::size_t to, std::size_t from, std::size_t view, bool by_track) {
    Assignment& given = assignments_[from * view_count_ + view];
    if (!given.has_ray()) return;
    given.by_track = by_track;
    assignments_[to * view_count_ + view] = given;
    views_[to] |= std::uint64_t{1} << view;
    clear(from, view);
  }

  bool any_shared() const { return any_shared_; }
  /// A ray that was removed by `unassign` in this set.
  struct ReleasedRay {
    std::uint16_t view, ray;
  };
  std::span<const ReleasedRay> released() const { return released_; }
  /// By ray of a view: the number of markers that had it after set_view(), less those of release_all().
  std::span<const std::uint8_t> use_counts(std::size_t view) const {
    return std::span(use_counts_).subspan(view * kMaxBlobs, kMaxBlobs);
  }
  /// Whether the ray belongs to one marker only.
  bool is_exclusive(std::size_t view, std::size_t ray) const {
    return !any_shared_ || use_counts_[view * kMaxBlobs + ray] == 1;
  }
  /// Whether any view has an exclusive ray of the marker.
  bool has_exclusive_ray(std::size_t marker) const {
    const std::span<const Assignment> views = of(marker);
    for (std::size_t view = 0; view < views.size(); ++view) {
      if (views[view].has_ray() && is_exclusive(view, views[view].ray)) return true;
    }
    return false;
  }
  /// Removes all assignments of a marker whose rays all belong to other markers too.
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
  std::vector<Assignment> assignments_;     // at marker * view count + view
  std::vector<std::uint64_t> views_;        // by marker: one bit for each view with a ray
  std::vector<AssignedRay> shared_places_;  // positions in shared blobs
  std::vector<ReleasedRay> released_;
  std::vector<std::uint8_t> use_counts_;  // at view * kMaxBlobs + ray: number of markers that have it
};

}  // namespace mocap::associate
