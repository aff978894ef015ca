#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/bounds.h"
#include "stages/share_blobs.h"
#include "stages/view_rays.h"

namespace mocap::stages {

/// What a view holds of a marker: as little as is asked about all of them.
struct Kept {
  static constexpr std::uint16_t kNone = 0xFFFF;

  std::uint16_t ray = kNone;
  std::uint16_t place = kNone;  ///< number of the place in a blob that is shared; kNone: the blob is the marker's alone
  std::uint16_t blob = 0;       ///< index in the BlobFrame
  bool own = false;             ///< the blob's 2D track was this marker's before
  float sigma_px = 0.0F;        ///< of the ray, or of the place

  bool has_ray() const { return ray != kNone; }
  bool is_shared() const { return place != kNone; }
};

/// What all views hold of all expected markers, marker by marker: the views are assigned one after the other, but the
/// questions are asked of each marker over its views. Never allocates after construction.
class HeldViews {
 public:
  HeldViews(std::size_t max_markers, std::size_t max_views)
      : kept_(max_markers * max_views), holders_(max_views * kMaxBlobs, 0) {
    places_.reserve(16 * max_markers);
  }

  /// A set of so many markers and views.
  void begin(std::size_t markers, std::size_t views) {
    marker_count_ = markers;
    view_count_ = views;
    places_.clear();
    any_shared_ = false;
  }

  /// Takes in what a view holds, by marker, and whose each of its rays is by its 2D track. `shared`: some rays have
  /// more than one holder.
  void keep(std::size_t view, const ViewRays& rays, std::span<const Held> held, std::span<const std::uint32_t> owner,
            bool shared) {
    any_shared_ = any_shared_ || shared;
    std::uint8_t* const holders = holders_.data() + view * kMaxBlobs;
    for (std::size_t ray = 0; ray < rays.size(); ++ray) holders[ray] = 0;
    Kept* to = kept_.data() + view;
    for (std::uint32_t m = 0; m < marker_count_; ++m, to += view_count_) {
      const Held& one = held[m];
      if (one.ray == Held::kNone) {
        *to = {};
        continue;
      }
      ++holders[one.ray];
      *to = kept_of(rays, one.ray, owner[one.ray] == m);
      if (one.sigma_px > 0.0F && places_.size() < places_.capacity()) {
        to->place = static_cast<std::uint16_t>(places_.size());
        to->sigma_px = one.sigma_px;
        places_.push_back(one);
      }
    }
  }

  const Kept& operator()(std::size_t marker, std::size_t view) const { return kept_[marker * view_count_ + view]; }
  /// All of a marker's, by view.
  std::span<const Kept> of(std::size_t marker) const {
    return std::span(kept_).subspan(marker * view_count_, view_count_);
  }
  /// What is known of a place that is shared.
  Held& place(const Kept& kept) { return places_[kept.place]; }
  const Held& place(const Kept& kept) const { return places_[kept.place]; }
  /// All that is known.
  Held held(std::size_t marker, std::size_t view) const {
    const Kept& kept = (*this)(marker, view);
    if (kept.is_shared()) return place(kept);
    Held held;
    if (kept.has_ray()) held.ray = kept.ray;
    return held;
  }

  void drop(std::size_t marker, std::size_t view) { kept_[marker * view_count_ + view] = {}; }
  /// The marker has the whole ray.
  void give(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray, bool own) {
    kept_[marker * view_count_ + view] = kept_of(rays, ray, own);
  }
  /// The first marker has what the second had, where that had anything; `own`: by its 2D track.
  void hand_over(std::size_t to, std::size_t from, std::size_t view, bool own) {
    Kept& given = kept_[from * view_count_ + view];
    if (given.has_ray()) {
      given.own = own;
      kept_[to * view_count_ + view] = given;
    }
    given = {};
  }

  bool any_shared() const { return any_shared_; }
  /// Whether one marker alone holds the ray.
  bool is_alone(std::size_t view, std::size_t ray) const {
    return !any_shared_ || holders_[view * kMaxBlobs + ray] == 1;
  }
  /// Whether a view shows this marker and no other.
  bool has_own_ray(std::size_t marker) const {
    const std::span<const Kept> views = of(marker);
    for (std::size_t view = 0; view < views.size(); ++view) {
      if (views[view].has_ray() && is_alone(view, views[view].ray)) return true;
    }
    return false;
  }
  /// A marker leaves all its rays to the others that hold them.
  void forsake(std::size_t marker) {
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Kept& kept = (*this)(marker, view);
      if (kept.has_ray()) --holders_[view * kMaxBlobs + kept.ray];
      drop(marker, view);
    }
  }

 private:
  static Kept kept_of(const ViewRays& rays, std::size_t ray, bool own) {
    return {static_cast<std::uint16_t>(ray), Kept::kNone, rays.blob[ray], own, static_cast<float>(rays.sigma_px[ray])};
  }

  std::size_t marker_count_ = 0;
  std::size_t view_count_ = 0;
  bool any_shared_ = false;
  std::vector<Kept> kept_;             // of marker * view count + view
  std::vector<Held> places_;           // that are shared
  std::vector<std::uint8_t> holders_;  // of view * kMaxBlobs + ray: how many markers hold it
};

}  // namespace mocap::stages
