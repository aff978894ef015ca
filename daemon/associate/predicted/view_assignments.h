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
      : kept_(max_markers * max_views), views_(max_markers, 0), holders_(max_views * kMaxBlobs, 0) {
    places_.reserve(16 * max_markers);
    given_up_.reserve(2 * max_markers * max_views);  // what is given up may be found again, once
  }

  /// A set of so many markers and views.
  void begin(std::size_t markers, std::size_t views) {
    marker_count_ = markers;
    view_count_ = views;
    places_.clear();
    given_up_.clear();
    std::fill_n(views_.begin(), markers, std::uint64_t{0});
    any_shared_ = false;
  }

  /// Takes in what a view holds, and whose each of its rays is by its 2D track. `shared`: some rays have more than one
  /// holder.
  void keep(std::size_t view, const ViewRays& rays, const ViewHolds& held, std::span<const std::uint32_t> owner,
            bool shared) {
    any_shared_ = any_shared_ || shared;
    std::uint8_t* const holders = holders_.data() + view * kMaxBlobs;
    std::fill_n(holders, rays.size(), std::uint8_t{0});
    const std::span<const std::uint32_t> of_markers = held.rays();
    Kept* to = kept_.data() + view;
    for (std::uint32_t m = 0; m < marker_count_; ++m, to += view_count_) {
      const std::uint32_t ray = of_markers[m];
      if (ray == Held::kNone) {
        *to = {};
        continue;
      }
      ++holders[ray];
      views_[m] |= std::uint64_t{1} << view;
      *to = kept_of(rays, ray, owner[ray] == m);
    }
    for (std::size_t i = 0; i < held.sharers().size() && places_.size() < places_.capacity(); ++i) {
      Kept& kept = kept_[held.sharers()[i] * view_count_ + view];
      kept.place = static_cast<std::uint16_t>(places_.size());
      kept.sigma_px = held.places()[i].sigma_px;
      places_.push_back(held.places()[i]);
    }
  }

  const Kept& operator()(std::size_t marker, std::size_t view) const { return kept_[marker * view_count_ + view]; }
  /// All of a marker's, by view.
  std::span<const Kept> of(std::size_t marker) const {
    return std::span(kept_).subspan(marker * view_count_, view_count_);
  }
  /// The views that hold a ray of a marker, a bit each.
  std::uint64_t views(std::size_t marker) const { return views_[marker]; }
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

  void drop(std::size_t marker, std::size_t view) {
    Kept& kept = kept_[marker * view_count_ + view];
    if (!kept.has_ray()) return;
    if (given_up_.size() < given_up_.capacity()) given_up_.push_back({static_cast<std::uint16_t>(view), kept.ray});
    clear(marker, view);
  }
  /// The marker has the whole ray.
  void give(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray, bool own) {
    kept_[marker * view_count_ + view] = kept_of(rays, ray, own);
    views_[marker] |= std::uint64_t{1} << view;
  }
  /// The first marker has what the second had, where that had anything; `own`: by its 2D track.
  void hand_over(std::size_t to, std::size_t from, std::size_t view, bool own) {
    Kept& given = kept_[from * view_count_ + view];
    if (!given.has_ray()) return;
    given.own = own;
    kept_[to * view_count_ + view] = given;
    views_[to] |= std::uint64_t{1} << view;
    clear(from, view);
  }

  bool any_shared() const { return any_shared_; }
  /// Of a set's rays those that a marker gave up since they were taken in, by `drop`.
  struct GivenUp {
    std::uint16_t view, ray;
  };
  std::span<const GivenUp> given_up() const { return given_up_; }
  /// How many markers held each ray of a view when it was taken in, without those that forsook it.
  std::span<const std::uint8_t> holders(std::size_t view) const {
    return std::span(holders_).subspan(view * kMaxBlobs, kMaxBlobs);
  }
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
    for (std::uint64_t views = views_[marker]; views != 0; views &= views - 1) {
      const auto view = static_cast<std::size_t>(std::countr_zero(views));
      --holders_[view * kMaxBlobs + (*this)(marker, view).ray];
      clear(marker, view);
    }
  }

 private:
  void clear(std::size_t marker, std::size_t view) {
    kept_[marker * view_count_ + view] = {};
    views_[marker] &= ~(std::uint64_t{1} << view);
  }
  static Kept kept_of(const ViewRays& rays, std::size_t ray, bool own) {
    return {static_cast<std::uint16_t>(ray), Kept::kNone, rays.blob[ray], own, rays.sigma_f[ray]};
  }

  std::size_t marker_count_ = 0;
  std::size_t view_count_ = 0;
  bool any_shared_ = false;
  std::vector<Kept> kept_;            // of marker * view count + view
  std::vector<std::uint64_t> views_;  // by marker: which hold a ray of it
  std::vector<Held> places_;          // that are shared
  std::vector<GivenUp> given_up_;
  std::vector<std::uint8_t> holders_;  // of view * kMaxBlobs + ray: how many markers hold it
};

}  // namespace mocap::associate
