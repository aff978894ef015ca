#include "associate/rays/listed_rays.h"

#include <algorithm>
#include <numeric>

#include "base/expects.h"

namespace mocap::associate {

void ListedRays::clear() {
  for (std::size_t i = 0; i < count_; ++i) has_[ray_[i]] = 0;
  count_ = binned_ = 0;
}

void ListedRays::add(std::size_t ray, const Place& at) {
  MOCAP_EXPECTS(count_ < kMaxBlobs);
  has_[ray] = 1;
  ray_[count_] = static_cast<std::uint16_t>(ray);
  x_[count_] = at.x;
  y_[count_] = at.y;
  variance_[count_++] = at.variance;
}

void ListedRays::add_all(const RayPlaces& rays) {
  MOCAP_EXPECTS(count_ == 0 && rays.x.size() <= kMaxBlobs);
  count_ = rays.x.size();
  std::fill_n(has_.begin(), count_, std::uint8_t{1});
  std::iota(ray_.begin(), ray_.begin() + static_cast<std::ptrdiff_t>(count_), std::uint16_t{0});
  std::ranges::copy(rays.x, x_.begin());
  std::ranges::copy(rays.y, y_.begin());
  std::ranges::copy(rays.variance, variance_.begin());
}

void ListedRays::bin(const RayBounds& bounds, float typical_variance, float sigmas) {
  // With so few rays a linear search is faster. Chosen by hand; not yet measured.
  constexpr std::size_t kFew = 4;
  if (count_ <= kFew) return;
  binned_ = count_;
  const RayPlaces places{{x_.data(), count_}, {y_.data(), count_}, {variance_.data(), count_}};
  bins_.fill(places, bounds, typical_variance, sigmas);
}

}  // namespace mocap::associate
