#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "model/bounds.h"

namespace mocap::associate {

/// The rays of one view as columns: position on the image plane at distance 1, and variance of each axis.
struct RayPlaces {
  std::span<const float> x, y, variance;
};

/// The bounds of the columns of RayPlaces.
struct RayBounds {
  float min_x = 0.0F, max_x = 0.0F, min_y = 0.0F, max_y = 0.0F, max_variance = 0.0F;
};

/// An index of the rays of one view for range queries: which rays lie in an axis-aligned rectangle (a gate).
///
/// Each axis is divided into bins. For each bin the index has a bit mask of the rays that begin or end before it; a
/// query combines four masks. A ray with a larger variance than typical extends over all bins whose gates may reach it;
/// so gates are dimensioned for the typical variance. Never allocates.
class RayBins {
 public:
  /// A rectangle of bins, half open: `left` and `top` are the first bins inside, `right` and `bottom` the first
  /// outside.
  struct Gate {
    std::size_t left, right, top, bottom;
  };
  /// Position x lies in bin (x - min_x) * per_x, from 0 to `bins`; y likewise.
  struct Scale {
    float min_x, min_y, per_x, per_y, bins;
  };

  /// Builds the index of at most kMaxBlobs rays within `bounds`. A ray whose variance exceeds `typical_variance`
  /// extends farther, by the difference that a gate of `sigmas` does not include.
  void fill(const RayPlaces& rays, const RayBounds& bounds, float typical_variance, float sigmas);

  const Scale& scale() const { return scale_; }
  /// The variance of a ray that a gate must include.
  float variance() const { return variance_; }

  /// Calls `visit` with the number n of a word and its bits: bit i is ray 64 n + i, set if the ray may be in the gate.
  template <class Visit>
  void visit_words(const Gate& gate, Visit&& visit) const {
    const std::size_t end = end_word_[gate.bottom];
    for (std::size_t word = first_word_[gate.top]; word < end; ++word) visit(word, word_of(gate, word));
  }
  /// Whether there are at most 64 rays; then `only_word_of` returns the bits of all rays that may be in the gate.
  bool has_one_word() const { return words_ == 1; }
  std::uint64_t only_word_of(const Gate& gate) const {
    return before_[4 * gate.right + kLeft] & ~before_[4 * gate.left + kRight] & before_[4 * gate.bottom + kTop] &
           ~before_[4 * gate.top + kBottom];
  }
  /// Calls `visit` with each ray that may be in the gate, in order.
  template <class Visit>
  void visit_rays(const Gate& gate, Visit&& visit) const {
    visit_words(gate, [&](std::size_t word, std::uint64_t bits) {
      for (; bits != 0; bits &= bits - 1) visit(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
    });
  }
  /// Calls `visit` with each ray whose extent comes within `half` of a position along both axes, and a few others.
  template <class Visit>
  void visit_near(float x, float y, float half, Visit&& visit) const {
    visit_rays({bin_of((x - half - scale_.min_x) * scale_.per_x - kRounding),
                bin_of((x + half - scale_.min_x) * scale_.per_x + kRounding + 1.0F),
                bin_of((y - half - scale_.min_y) * scale_.per_y - kRounding),
                bin_of((y + half - scale_.min_y) * scale_.per_y + kRounding + 1.0F)},
               visit);
  }

  /// Margin of a gate, in bins, for the rounding of single precision.
  static constexpr float kRounding = 0.01F;

 private:
  static constexpr std::size_t kMaxBins = 128;
  static constexpr std::size_t kWords = kMaxBlobs / 64;
  using Bins = std::array<std::int32_t, kMaxBlobs>;  // by ray
  // The ends of the extent of a ray.
  enum End : std::size_t { kLeft, kRight, kTop, kBottom };

  // The rays that begin before the right end of the gate and do not end before its left end; likewise in y.
  std::uint64_t word_of(const Gate& gate, std::size_t word) const {
    const std::uint64_t* const from = before_.data() + 4 * word;
    const std::size_t bin = 4 * words_;
    return from[gate.right * bin + kLeft] & ~from[gate.left * bin + kRight] & from[gate.bottom * bin + kTop] &
           ~from[gate.top * bin + kBottom];
  }
  // Positions outside the bounds go to the first or last bin, NaN to the first.
  std::size_t bin_of(float at) const {
    const float low = at > 0.0F ? at : 0.0F;
    return static_cast<std::size_t>(low < scale_.bins ? low : scale_.bins);
  }
  // The extent of a ray beyond its position, for the part of its variance that a gate does not include.
  float reach(float variance) const { return sigmas_ * std::sqrt(std::max(0.0F, variance - typical_variance_)); }
  void find_extents(const RayPlaces& rays);
  void mark_extents();
  void accumulate_masks();
  void bound_words();

  Scale scale_{};
  float sigmas_ = 0.0F;
  float typical_variance_ = 0.0F;
  float variance_ = 0.0F;
  std::size_t count_ = 0;
  std::size_t words_ = 0;
  std::size_t bins_ = 0;
  // Masks of the rays whose end lies before a bin, at (bin * words_ + word) * 4 + end.
  alignas(32) std::array<std::uint64_t, 4 * (kMaxBins + 1) * kWords> before_{};
  // The rays come approximately in the order of y, so a query needs few words: the rays that end in bin b or later are
  // in the words from first_word_[b] on, the rays that begin before bin b are in the words before end_word_[b].
  std::array<std::uint8_t, kMaxBins + 1> first_word_{}, end_word_{};
  // By ray: the bin after the one in which each end lies.
  Bins left_{}, right_{}, top_{}, bottom_{};
};

}  // namespace mocap::associate
