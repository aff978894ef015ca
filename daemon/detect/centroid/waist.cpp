#include "detect/centroid/waist.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mocap::detect {
namespace {

// Relative depth of a minimum below the smaller of the two maxima beside it. From kSplitDip on, the component is two
// discs; from kDoubtfulDip on, it may be. Each of 100,000 rendered single discs, elongated up to three times their
// width or not, was below kDoubtfulDip.
constexpr double kSplitDip = 0.10;
constexpr double kDoubtfulDip = 0.05;
constexpr int kBins = 2 * kMaxBox_px;

}  // namespace

Waist find_waist(const Box& box, std::uint32_t threshold, const Eigen::Vector2d& middle_px,
                 const Eigen::Vector2d& axis) {
  // No pixel is farther from the centre than the diagonal of the box: only these bins are used, and the outermost bins
  // are dark.
  const auto reach = static_cast<std::size_t>(std::hypot(box.width_px, box.height_px)) + 3;
  const std::size_t first = kBins / 2 - std::min<std::size_t>(reach, kBins / 2);
  const std::size_t end = std::min<std::size_t>(kBins / 2 + reach + 1, kBins);
  // Light along the axis; the light of a pixel is distributed to the two nearest bins.
  std::array<double, kBins> light;
  std::fill(light.begin() + first, light.begin() + end, 0.0);
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; ++x) {
      const std::uint32_t grey = box.pixels[y * box.width_px + x];
      if (grey < threshold) continue;
      const double at = axis.dot(Eigen::Vector2d(x, y) - middle_px) + kBins / 2;
      const auto bin = static_cast<std::size_t>(std::clamp(at, 0.0, kBins - 2.0));
      const double share = at - static_cast<double>(bin);
      light[bin] += (1.0 - share) * grey;
      light[bin + 1] += share * grey;
    }
  }
  std::array<double, kBins> smooth;
  smooth[first] = smooth[end - 1] = 0.0;
  for (std::size_t i = first + 1; i + 1 < end; ++i) smooth[i] = 0.25 * (light[i - 1] + 2.0 * light[i] + light[i + 1]);
  std::array<double, kBins> after;  // maximum from a bin on
  after[end - 1] = 0.0;
  for (std::size_t i = end - 1; i-- > first;) after[i] = std::max(after[i + 1], smooth[i]);
  double before = 0.0, best = 0.0;
  Waist waist;
  for (std::size_t i = first; i < end; ++i) {
    before = std::max(before, smooth[i]);
    const double hump = std::min(before, after[i]);
    const double dip = hump > 0.0 ? (hump - smooth[i]) / hump : 0.0;
    if (dip <= best) continue;
    best = dip;
    waist.at_px = static_cast<double>(i) - kBins / 2;
  }
  waist.splits = best >= kSplitDip;
  waist.doubtful = best >= kDoubtfulDip;
  return waist;
}

void keep_side(std::span<std::uint16_t> pixels, const Box& box, const Eigen::Vector2d& middle_px,
               const Eigen::Vector2d& axis, double at_px, bool far_side) {
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; ++x) {
      const bool is_far = axis.dot(Eigen::Vector2d(x, y) - middle_px) >= at_px;
      if (is_far != far_side) pixels[static_cast<std::size_t>(y * box.width_px + x)] = 0;
    }
  }
}

Eigen::Vector3d moments_of(const Box& box, std::uint32_t threshold) {
  double n = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; ++x) {
      if (box.pixels[y * box.width_px + x] < threshold) continue;
      const Eigen::Vector2d at(x, y);
      n += 1.0;
      sum += at;
      squares += at * at.transpose();
    }
  }
  if (n == 0.0) return Eigen::Vector3d(1.0, 1.0, 0.0);
  const Eigen::Matrix2d moments = squares / n - sum / n * (sum / n).transpose() + Eigen::Matrix2d::Identity() / 12.0;
  return {moments(0, 0), moments(1, 1), moments(0, 1)};
}

}  // namespace mocap::detect
