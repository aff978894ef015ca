#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/bounds.h"

namespace mocap::associate {

/// The assignment of a ray of one view to a predicted marker, with the position of the marker in a shared blob.
struct AssignedRay {
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  std::uint32_t ray = kNone;
  std::uint32_t quadric = kNone;                     ///< index of the quadric of that position, or kNone
  Eigen::Vector2f offset = Eigen::Vector2f::Zero();  ///< from the ray, on the image plane at distance 1
  float sigma_px = 0.0F;                             ///< of that position; 0: the sigma_px of the ray
  bool hidden = false;  ///< the marker is absent, or occluded by the marker to which the ray belongs
};

/// The assignments of one view's rays to all predicted markers. Never allocates after construction.
class RayAssignments {
 public:
  static constexpr std::uint32_t kNone = AssignedRay::kNone;

  explicit RayAssignments(std::size_t max_markers) : ray_(max_markers, kNone), place_index_(max_markers, kNone) {
    shared_markers_.reserve(max_markers);
    shared_places_.reserve(max_markers);
  }

  /// Begins a view with this number of markers and rays, all unassigned.
  void begin(std::size_t markers, std::size_t rays) {
    for (const std::uint32_t marker : shared_markers_) place_index_[marker] = kNone;
    shared_markers_.clear();
    shared_places_.clear();
    marker_count_ = markers;
    std::fill_n(ray_.begin(), markers, kNone);
    std::fill_n(assigned_marker_.begin(), rays, kNone);
  }

  /// The ray of each marker, or kNone.
  std::span<const std::uint32_t> rays() const { return std::span(ray_).first(marker_count_); }
  /// The marker to which a ray is assigned (the first of several), or kNone.
  std::uint32_t assigned_marker(std::size_t ray) const { return assigned_marker_[ray]; }

  void assign(std::uint32_t marker, std::uint32_t ray) {
    ray_[marker] = ray;
    assigned_marker_[ray] = marker;
  }
  void release(std::uint32_t marker) {
    assigned_marker_[ray_[marker]] = kNone;
    ray_[marker] = kNone;
  }

  /// Assigns a shared ray; the caller writes the position of the marker into the result.
  AssignedRay& assign_shared(std::uint32_t marker, std::uint32_t ray) {
    ray_[marker] = ray;
    if (place_index_[marker] == kNone) {
      place_index_[marker] = static_cast<std::uint32_t>(shared_places_.size());
      shared_markers_.push_back(marker);
      shared_places_.push_back({});
    }
    AssignedRay& shared_place = shared_places_[place_index_[marker]];
    shared_place.ray = ray;
    return shared_place;
  }
  /// The markers with a shared ray, and their positions in the same order.
  std::span<const std::uint32_t> shared_markers() const { return shared_markers_; }
  std::span<const AssignedRay> shared_places() const { return shared_places_; }

 private:
  std::size_t marker_count_ = 0;
  std::vector<std::uint32_t> ray_;          // by marker
  std::vector<std::uint32_t> place_index_;  // by marker: index of its shared position, or kNone
  std::vector<std::uint32_t> assigned_marker_ = std::vector(kMaxBlobs, kNone);  // by ray
  std::vector<std::uint32_t> shared_markers_;
  std::vector<AssignedRay> shared_places_;
};

}  // namespace mocap::associate
