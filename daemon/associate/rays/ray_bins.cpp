#include "associate/rays/ray_bins.h"

#include <cmath>
#include <cstring>

#include "base/expects.h"
#include "base/loops.h"

namespace mocap::associate {

void RayBins::fill(const RayPlaces& rays, const RayBounds& bounds, float typical_variance, float sigmas) {
  constexpr std::size_t kMany = 2 * 64,
                        kFew = 16;  // fine bins pay off only for many rays; chosen by hand, not yet measured
  constexpr float kMinExtent = 1e-9F;
  count_ = rays.x.size();
  MOCAP_EXPECTS(count_ <= kMaxBlobs);
  words_ = (count_ + 63) / 64;
  bins_ = count_ > kMany ? kMaxBins : count_ > kFew ? kMaxBins / 2 : kMaxBins / 8;
  sigmas_ = sigmas;
  typical_variance_ = typical_variance;
  variance_ = std::min(bounds.max_variance, typical_variance);
  const float most = reach(bounds.max_variance);  // extents reach beyond the bounds of the positions
  const auto bins = static_cast<float>(bins_);
  scale_ = {bounds.min_x - most, bounds.min_y - most,
            bins / std::max(kMinExtent, bounds.max_x - bounds.min_x + 2.0F * most),
            bins / std::max(kMinExtent, bounds.max_y - bounds.min_y + 2.0F * most), bins};
  find_extents(rays);
  mark_extents();
  accumulate_masks();
  bound_words();
}

// sqrt(a + b) <= sqrt(a) + sqrt(b): a gate for the typical variance and the extent of a ray for the rest of its
// variance overlap if the ray is in the full gate.
MOCAP_WIDE void RayBins::find_extents(const RayPlaces& rays) {
  const float sigmas = sigmas_, typical_variance = typical_variance_;
  const auto [min_x, min_y, per_x, per_y, bins] = scale_;
  const float last = bins - 1.0F;  // the last ray lies in the last bin, not after it
  const float *x = rays.x.data(), *y = rays.y.data(), *variance = rays.variance.data();
  std::int32_t *left = left_.data(), *right = right_.data(), *top = top_.data(), *bottom = bottom_.data();
  const auto after = [last](float at) {
    const float low = at > 0.0F ? at : 0.0F;
    return static_cast<std::int32_t>(low < last ? low : last) + 1;
  };
  const std::size_t count = count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t ray = 0; ray < count; ++ray) {
    const float over = variance[ray] - typical_variance;
    const float reach = sigmas * std::sqrt(over > 0.0F ? over : 0.0F);
    left[ray] = after((x[ray] - reach - min_x) * per_x);
    right[ray] = after((x[ray] + reach - min_x) * per_x);
    top[ray] = after((y[ray] - reach - min_y) * per_y);
    bottom[ray] = after((y[ray] + reach - min_y) * per_y);
  }
}

void RayBins::mark_extents() {
  std::fill_n(before_.begin(), 4 * (bins_ + 1) * words_, std::uint64_t{0});
  const std::size_t bin = 4 * words_;
  for (std::size_t ray = 0; ray < count_; ++ray) {
    std::uint64_t* const from = before_.data() + 4 * (ray / 64);
    const std::uint64_t bit = std::uint64_t{1} << (ray % 64);
    from[static_cast<std::size_t>(left_[ray]) * bin + kLeft] |= bit;
    from[static_cast<std::size_t>(right_[ray]) * bin + kRight] |= bit;
    from[static_cast<std::size_t>(top_[ray]) * bin + kTop] |= bit;
    from[static_cast<std::size_t>(bottom_[ray]) * bin + kBottom] |= bit;
  }
}

// Prefix union: the end of a ray before a bin is also before all later bins.
MOCAP_WIDE void RayBins::accumulate_masks() {
  using Four = std::uint64_t __attribute__((vector_size(32)));
  for (std::size_t word = 0; word < words_; ++word) {
    Four sum{};
    std::uint64_t* at = before_.data() + 4 * word;
    for (std::size_t bin = 0; bin <= bins_; ++bin, at += 4 * words_) {
      Four in_bin;
      std::memcpy(&in_bin, at, sizeof in_bin);
      sum |= in_bin;
      std::memcpy(at, &sum, sizeof sum);
    }
  }
}

// Computes first_word_ and end_word_.
MOCAP_WIDE void RayBins::bound_words() {
  const auto all = static_cast<std::uint8_t>(words_);
  first_word_.fill(words_ == 1 ? std::uint8_t{0} : all);
  end_word_.fill(words_ == 1 ? all : std::uint8_t{0});
  if (words_ <= 1) return;
  // In reverse order, earlier words overwrite the entries of later ones; then in order, later words overwrite.
  for (std::size_t word = words_; word-- > 0;) {
    std::int32_t most = 0;
    for (std::size_t ray = 64 * word; ray < std::min(count_, 64 * word + 64); ++ray)
      most = std::max(most, bottom_[ray]);
    std::fill_n(first_word_.begin(), most, static_cast<std::uint8_t>(word));
  }
  for (std::size_t word = 0; word < words_; ++word) {
    auto least = static_cast<std::int32_t>(bins_);
    for (std::size_t ray = 64 * word; ray < std::min(count_, 64 * word + 64); ++ray) least = std::min(least, top_[ray]);
    std::fill(end_word_.begin() + least, end_word_.begin() + static_cast<std::ptrdiff_t>(bins_) + 1,
              static_cast<std::uint8_t>(word + 1));
  }
}

}  // namespace mocap::associate
