#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/bounds.h"

namespace mocap::associate {

/// What one view holds of an expected marker: a ray, or kNone; and where the marker is in a blob that several share.
struct Held {
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  std::uint32_t ray = kNone;
  std::uint32_t quadric = kNone;                  ///< the holder's own number for that place as a ray
  Eigen::Vector2f off = Eigen::Vector2f::Zero();  ///< from the ray, on the image plane at distance 1
  float sigma_px = 0.0F;                          ///< of that place; 0: the ray's own
  bool hidden = false;  ///< behind the light of the one whose ray it is, if it is there at all
};

/// What one view holds of all expected markers. Never allocates after construction.
class ViewHolds {
 public:
  static constexpr std::uint32_t kNone = Held::kNone;

  explicit ViewHolds(std::size_t max_markers) : ray_(max_markers, kNone), place_(max_markers, kNone) {
    sharers_.reserve(max_markers);
    places_.reserve(max_markers);
  }

  /// A view of so many rays and markers, none of which it holds yet.
  void begin(std::size_t markers, std::size_t rays) {
    for (const std::uint32_t marker : sharers_) place_[marker] = kNone;
    sharers_.clear();
    places_.clear();
    marker_count_ = markers;
    std::fill_n(ray_.begin(), markers, kNone);
    std::fill_n(holder_.begin(), rays, kNone);
  }

  /// By marker: its ray, or kNone.
  std::span<const std::uint32_t> rays() const { return std::span(ray_).first(marker_count_); }
  /// The marker that has a ray, the first of several; or kNone.
  std::uint32_t holder(std::size_t ray) const { return holder_[ray]; }

  void hold(std::uint32_t marker, std::uint32_t ray) {
    ray_[marker] = ray;
    holder_[ray] = marker;
  }
  void let_go(std::uint32_t marker) {
    holder_[ray_[marker]] = kNone;
    ray_[marker] = kNone;
  }

  /// The place of a marker in a ray that it shares with its holder.
  Held& share(std::uint32_t marker, std::uint32_t ray) {
    ray_[marker] = ray;
    if (place_[marker] == kNone) {
      place_[marker] = static_cast<std::uint32_t>(places_.size());
      sharers_.push_back(marker);
      places_.push_back({});
    }
    Held& place = places_[place_[marker]];
    place.ray = ray;
    return place;
  }
  /// The markers that have such a place, and their places in the same order.
  std::span<const std::uint32_t> sharers() const { return sharers_; }
  std::span<const Held> places() const { return places_; }

 private:
  std::size_t marker_count_ = 0;
  std::vector<std::uint32_t> ray_;                                     // by marker
  std::vector<std::uint32_t> place_;                                   // by marker: number of its place, or kNone
  std::vector<std::uint32_t> holder_ = std::vector(kMaxBlobs, kNone);  // by ray
  std::vector<std::uint32_t> sharers_;
  std::vector<Held> places_;
};

}  // namespace mocap::associate
