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

/// Rays of one image, a column for each number: place on the image plane at distance 1, and variance of either axis.
struct RayPlaces {
  std::span<const float> x, y, variance;
};

/// Bounds of such columns.
struct RayBounds {
  float min_x = 0.0F, max_x = 0.0F, min_y = 0.0F, max_y = 0.0F, max_variance = 0.0F;
};

/// Finds the rays near a place. An image's rays lie in columns and rows of bins; of each it is written down which rays
/// lie before it, a bit each.
///
/// A ray that is far less certain than most reaches over all bins from which a gate might look for it, so that gates
/// need not be wide for the sake of a few. Never allocates.
class RayBins {
 public:
  /// Where a place's bounds lie among the columns and rows of bins: the first that counts, and the first that does not.
  struct Gate {
    std::size_t left, right, top, bottom;
  };
  /// x lies in bin (x - min_x) * per_x, from 0 to `bins`.
  struct Scale {
    float min_x, min_y, per_x, per_y, bins;
  };

  /// Takes in an image's rays, kMaxBlobs at most, which lie within `bounds`. Those whose variance is over the usual
  /// reach farther, by what a gate of so many `sigmas` would have to reckon with.
  void fill(const RayPlaces& rays, const RayBounds& bounds, float typical_variance, float sigmas);

  const Scale& scale() const { return scale_; }
  /// What a gate must reckon with as a ray's own variance.
  float variance() const { return variance_; }

  /// Calls `visit` with a word's number and its bits, one for each ray from 64 times the number on, which may be in the
  /// gate.
  template <class Visit>
  void visit_words(const Gate& gate, Visit&& visit) const {
    const std::size_t end = end_word_[gate.bottom];
    for (std::size_t word = first_word_[gate.top]; word < end; ++word) visit(word, word_of(gate, word));
  }
  /// The only word, of at most 64 rays.
  bool has_one_word() const { return words_ == 1; }
  std::uint64_t only_word_of(const Gate& gate) const {
    return before_[4 * gate.right + kLeft] & ~before_[4 * gate.left + kRight] & before_[4 * gate.bottom + kTop] &
           ~before_[4 * gate.top + kBottom];
  }
  /// Calls `visit` with each ray that may be in the gate, in their order.
  template <class Visit>
  void visit_rays(const Gate& gate, Visit&& visit) const {
    visit_words(gate, [&](std::size_t word, std::uint64_t bits) {
      for (; bits != 0; bits &= bits - 1) visit(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
    });
  }
  /// Calls `visit` with each ray that reaches to within `half` of a place along either axis, and a few others near it.
  template <class Visit>
  void visit_near(float x, float y, float half, Visit&& visit) const {
    visit_rays({bin_of((x - half - scale_.min_x) * scale_.per_x - kRounding),
                bin_of((x + half - scale_.min_x) * scale_.per_x + kRounding + 1.0F),
                bin_of((y - half - scale_.min_y) * scale_.per_y - kRounding),
                bin_of((y + half - scale_.min_y) * scale_.per_y + kRounding + 1.0F)},
               visit);
  }

  /// Of a bin: rays are put into bins in single precision, which is finer than that.
  static constexpr float kRounding = 0.01F;

 private:
  static constexpr std::size_t kMaxBins = 128;
  static constexpr std::size_t kWords = kMaxBlobs / 64;
  using Bins = std::array<std::int32_t, kMaxBlobs>;  // by ray
  // The ends of a ray.
  enum End : std::size_t { kLeft, kRight, kTop, kBottom };

  // Those whose left end lies before the right one of the gate, and whose right end not before its left one; likewise
  // in y.
  std::uint64_t word_of(const Gate& gate, std::size_t word) const {
    const std::uint64_t* const from = before_.data() + 4 * word;
    const std::size_t bin = 4 * words_;
    return from[gate.right * bin + kLeft] & ~from[gate.left * bin + kRight] & from[gate.bottom * bin + kTop] &
           ~from[gate.top * bin + kBottom];
  }
  // What is out of bounds on either side, or no number, goes to an end.
  std::size_t bin_of(float at) const {
    const float low = at > 0.0F ? at : 0.0F;
    return static_cast<std::size_t>(low < scale_.bins ? low : scale_.bins);
  }
  // How far a ray of that variance reaches, so that a gate need not.
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
  // Which rays' ends lie before each bin: of (bin * words_ + word) * 4 + end.
  alignas(32) std::array<std::uint64_t, 4 * (kMaxBins + 1) * kWords> before_{};
  // Rays come about in the order of y: those that end in the bins from b on begin in the word first_word_[b], those
  // that begin before b end before the word end_word_[b].
  std::array<std::uint8_t, kMaxBins + 1> first_word_{}, end_word_{};
  // The bin after the one that each ray's ends lie in.
  Bins left_{}, right_{}, top_{}, bottom_{};
};

}  // namespace mocap::associate
