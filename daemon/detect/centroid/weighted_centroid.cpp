#include "detect/centroid/weighted_centroid.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/expects.h"

namespace mocap::detect {
namespace {

// Standard deviation of the centroid from the pixel grid, for a disc of radius 1 px and each px that its edge is
// narrower than an edge that the grid samples well; inversely proportional to the radius. Measured on rendered discs.
constexpr double kGridSigma_px = 0.03;
constexpr double kSampledEdge_px = 0.8;
constexpr double kEdgeOfSmall_px2 = 0.2;
// Relative increase of the noise error over that of the weights 3u^2 - 2u^3, for each px of that narrowness.
constexpr double kNarrowLoss = 0.3;
// Factor from the integer sums of the kernels to the slope 6 u (1 - u) of 3u^2 - 2u^3.
constexpr double kSlopeOfSum = 6.0 * kFullWeight / (4.0 * kFullSlope);
// The weight of a pixel is (1 - b - c) u + b u^2 + c u^3. b and c are polynomials in s and e, with these coefficients
// of 1, s, e, s^2, s e, e^2, for a blob of radius 1/s and edge width e, px. The coefficients minimise the error from
// noise and pixel grid together. Fitted to rendered discs of radius 0.7 to 11 px, blurred by 0.05 to 1.2 px, of 4
// ratios of brightness to noise.
constexpr std::array<double, 6> kSquares{-0.0061, -0.3332, -0.6927, 0.1125, 1.5443, 3.0603};
constexpr std::array<double, 6> kCubes{0.0629, 0.1792, 0.2587, -0.2701, 0.6469, -2.2417};
constexpr double kLeastRadius_px = 0.6;
constexpr double kLeastWeightedEdge_px = 0.2;
constexpr double kMostWeightedEdge_px = 1.1;
// Lower bound of the roundness: the roundness of a line is 0.
constexpr double kLeastRoundness = 0.05;

/// The weights a u + b u^2 + c u^3 with a + b + c = 1, one blob in each lane.
template <class V>
struct Cubic {
  V a, b, c;

  V apply(const V (&sums)[kPowers]) const { return a * sums[0] + b * sums[1] + c * sums[2]; }
};

template <class V>
Cubic<V> weights_for(const V& radius_px, const V& edge_px) {
  const V s = 1.0 / radius_px.max(kLeastRadius_px), e = edge_px.max(kLeastWeightedEdge_px).min(kMostWeightedEdge_px);
  // The terms are added in pairs, which shortens the chain of dependent additions.
  const auto at = [&s, &e](const std::array<double, 6>& k) -> V {
    return (k[0] + k[1] * s) + (k[2] + k[4] * s) * e + (k[3] * (s * s) + k[5] * (e * e));
  };
  const V b = at(kSquares), c = at(kCubes);
  return {1.0 - b - c, b, c};
}

/// The sums of several blobs, one blob in each lane.
struct Lanes {
  using V = Eigen::Array<double, kBlobLanes, 1>;
  V weight[kPowers], x[kPowers], y[kPowers];
  V slope2, least_x, least_y, most_x, most_y, span, bright, roundness;

  explicit Lanes(std::span<const IntensitySums> intensity_sums) {
    for (std::size_t k = 0; k < kBlobLanes; ++k) {
      const auto lane = static_cast<Eigen::Index>(k);
      const IntensitySums& intensity =
          intensity_sums[k < intensity_sums.size() ? k : 0];  // unused lanes repeat the first blob
      for (int power = 0; power < kPowers; ++power) {
        weight[power][lane] = static_cast<double>(intensity.sums.weight[power]);
        x[power][lane] = static_cast<double>(intensity.sums.x[power]);
        y[power][lane] = static_cast<double>(intensity.sums.y[power]);
      }
      slope2[lane] = static_cast<double>(intensity.sums.slope2);
      least_x[lane] = intensity.begin_x - 0.5 - intensity.middle_x;
      least_y[lane] = intensity.begin_y - 0.5 - intensity.middle_y;
      most_x[lane] = intensity.end_x - 0.5 - intensity.middle_x;
      most_y[lane] = intensity.end_y - 0.5 - intensity.middle_y;
      span[lane] = intensity.span;
      bright[lane] = intensity.bright;
      roundness[lane] = intensity.roundness;
    }
  }
};

}  // namespace

void measure_blobs(const GreyLevels& grey_levels, std::span<const IntensitySums> intensity_sums,
                   std::span<MeasuredBlob> found) {
  MOCAP_EXPECTS(!intensity_sums.empty() && intensity_sums.size() <= kBlobLanes &&
                found.size() >= intensity_sums.size());
  using V = Lanes::V;
  const Lanes lanes(intensity_sums);
  // The radius of a disc with the same sum of u; the edge is where u is between 0 and 1.
  const V radius_px = (lanes.weight[0] / (kFullWeight * M_PI)).sqrt();
  const V edge_px = radius_px * (1.0 - lanes.weight[1] / lanes.weight[0]);
  const Cubic<V> cubic = weights_for(radius_px, edge_px);
  const V weight = cubic.apply(lanes.weight), cubic_x = cubic.apply(lanes.x) / weight,
          cubic_y = cubic.apply(lanes.y) / weight;
  // Cubic weights may be negative. If a blob is not a disc, its sum of weights may then be near 0 and the centroid
  // outside of the box: the weight u, which is never negative, is used instead.
  const auto is_inside =
      cubic_x >= lanes.least_x && cubic_x <= lanes.most_x && cubic_y >= lanes.least_y && cubic_y <= lanes.most_y;
  const V x = is_inside.select(cubic_x, lanes.x[0] / lanes.weight[0]),
          y = is_inside.select(cubic_y, lanes.y[0] / lanes.weight[0]);
  // Noise of pixel i moves the centroid by slope_i (x_i - x) noise / weight; mean of both axes. The slopes are those of
  // 3u^2 - 2u^3, whose error differs from that of the actual weights by some percent. Pixels with a slope lie on the
  // rim, so their mean squared distance from the centre is that of the rim of an ellipse with the same area.
  const V stretch = 0.5 * (lanes.roundness + 1.0 / lanes.roundness.max(kLeastRoundness));
  const V lever = lanes.slope2 * radius_px * radius_px * stretch;
  const V smooth = 3.0 * lanes.weight[1] - 2.0 * lanes.weight[2];
  const V moved = grey_levels.noise * kSlopeOfSum / lanes.span * (0.5 * lever).max(0.0).sqrt() / smooth;
  // The measured edge width of a small disc is too small, because the inner part of its edge reaches the centre.
  const V narrow_px = (kSampledEdge_px - kEdgeOfSmall_px2 / radius_px - edge_px).max(0.0);
  const V by_noise_px = (1.0 + kNarrowLoss * narrow_px) * moved, by_grid_px = kGridSigma_px * narrow_px / radius_px;
  const V sigma_px = (by_noise_px * by_noise_px + by_grid_px * by_grid_px).sqrt();
  // A blob that is not a disc may have no slope: then its size alone bounds the error.
  const V known_px =
      (sigma_px > 0.0 && sigma_px.isFinite()).select(sigma_px, kUnknownCentroidSigma * (lanes.bright / M_PI).sqrt());
  for (std::size_t k = 0; k < intensity_sums.size(); ++k) {
    const auto lane = static_cast<Eigen::Index>(k);
    const IntensitySums& intensity = intensity_sums[k];
    Blob& blob = found[k].blob;
    blob = {};
    blob.centroid = {{x[lane] + intensity.middle_x, y[lane] + intensity.middle_y}};
    blob.area_px2 = intensity.bright;
    blob.peak = std::min(1.0, static_cast<double>(intensity.peak) / grey_levels.top);
    blob.saturated = static_cast<double>(intensity.at_top) / intensity.bright;
    blob.roundness = intensity.roundness;
    blob.sigma_px = known_px[lane];
    found[k].radius_px = radius_px[lane];
    found[k].edge_px = edge_px[lane];
  }
}

MeasuredBlob measure_blob(const GreyLevels& grey_levels, const IntensitySums& intensity) {
  MeasuredBlob found;
  measure_blobs(grey_levels, std::span(&intensity, 1), std::span(&found, 1));
  return found;
}

}  // namespace mocap::detect
