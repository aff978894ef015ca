#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "associate/rays/ray_bins.h"
#include "model/bounds.h"

namespace mocap::associate {

/// A subset of the rays of one view, for a search near a position. Never allocates.
class ListedRays {
 public:
  struct Place {
    float x, y, variance;  ///< as in RayPlaces
  };

  void clear();
  void add(std::size_t ray, const Place& at);
  /// Adds all rays of a view. Precondition: the list is empty.
  void add_all(const RayPlaces& rays);
  bool has(std::size_t ray) const { return has_[ray] != 0; }
  /// Sorts the listed rays into bins, as RayBins::fill. A few rays may be added afterwards.
  void bin(const RayBounds& bounds, float typical_variance, float sigmas);

  const RayBins::Scale& scale() const { return bins_.scale(); }
  /// Calls `visit` with each ray that may be in the gate, and its position. Some visited rays may lie outside.
  template <class Visit>
  void visit(const RayBins::Gate& gate, Visit&& visit) const {
    const auto visit_ray = [&](std::size_t i) { visit(ray_[i], Place{x_[i], y_[i], variance_[i]}); };
    if (binned_ > 0) bins_.visit_rays(gate, visit_ray);
    for (std::size_t i = binned_; i < count_; ++i) visit_ray(i);
  }

 private:
  std::size_t count_ = 0;
  std::array<std::uint16_t, kMaxBlobs> ray_{};
  std::array<float, kMaxBlobs> x_{}, y_{}, variance_{};
  std::array<std::uint8_t, kMaxBlobs> has_{};  // by ray
  std::size_t binned_ = 0;                     // number of rays, from the first on, that are in the bins
  RayBins bins_;
};

}  // namespace mocap::associate
