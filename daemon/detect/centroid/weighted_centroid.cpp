#include "detect/centroid/weighted_centroid.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/expects.h"

namespace mocap::detect {
namespace {

// What the pixel grid leaves of the centroid of a disc of radius 1 px, for each px that its edge is narrower than an
// edge which the grid samples well; in inverse proportion to the radius. Measured on rendered discs.
constexpr double kGridSigma_px = 0.03;
constexpr double kSampledEdge_px = 0.8;
constexpr double kEdgeOfSmall_px2 = 0.2;
// By what share the weights do worse than 3u^2 - 2u^3 would without a grid, for each px of such narrowness.
constexpr double kNarrowLoss = 0.3;
// The slope of 3u^2 - 2u^3, which is 6 u (1 - u), of the whole numbers that the kernels add up.
constexpr double kSlopeOfSum = 6.0 * kFullWeight / (4.0 * kFullSlope);
// How much of u^2 and of u^3 is in the weights, by 1, s, e, s^2, s e, e^2 of a blob with radius 1/s and an edge e px
// wide; the rest is u. Such weights leave the centroid the least error by noise and grid together. Fitted to rendered
// discs of radius 0.7 to 11 px, blurred by 0.05 to 1.2 px, of 4 brightnesses over noise.
constexpr std::array<double, 6> kSquares{-0.0061, -0.3332, -0.6927, 0.1125, 1.5443, 3.0603};
constexpr std::array<double, 6> kCubes{0.0629, 0.1792, 0.2587, -0.2701, 0.6469, -2.2417};
constexpr double kLeastRadius_px = 0.6;
constexpr double kLeastEdge_px = 0.2;
constexpr double kMostEdge_px = 1.1;
// Of a line, which has no other axis.
constexpr double kLeastRoundness = 0.05;

/// Weights a u + b u^2 + c u^3, a + b + c = 1, of a blob in each lane.
template <class V>
struct Cubic {
  V a, b, c;

  V of(const V (&sums)[kPowers]) const { return a * sums[0] + b * sums[1] + c * sums[2]; }
};

template <class V>
Cubic<V> weights_for(const V& radius_px, const V& edge_px) {
  const V s = 1.0 / radius_px.max(kLeastRadius_px), e = edge_px.max(kLeastEdge_px).min(kMostEdge_px);
  // In pairs, so that no sum waits for more than two others.
  const auto at = [&s, &e](const std::array<double, 6>& k) -> V {
    return (k[0] + k[1] * s) + (k[2] + k[4] * s) * e + (k[3] * (s * s) + k[5] * (e * e));
  };
  const V b = at(kSquares), c = at(kCubes);
  return {1.0 - b - c, b, c};
}

/// What lights tell, one in each lane.
struct Lanes {
  using V = Eigen::Array<double, kBlobLanes, 1>;
  V weight[kPowers], x[kPowers], y[kPowers];
  V slope2, half_width, half_height, span, bright, roundness;

  explicit Lanes(std::span<const IntensitySums> intensity_sums) {
    for (std::size_t k = 0; k < kBlobLanes; ++k) {
      const auto lane = static_cast<Eigen::Index>(k);
      const IntensitySums& intensity =
          intensity_sums[k < intensity_sums.size() ? k : 0];  // lanes left over repeat the first
      for (int power = 0; power < kPowers; ++power) {
        weight[power][lane] = static_cast<double>(intensity.sums.weight[power]);
        x[power][lane] = static_cast<double>(intensity.sums.x[power]);
        y[power][lane] = static_cast<double>(intensity.sums.y[power]);
      }
      slope2[lane] = static_cast<double>(intensity.sums.slope2);
      half_width[lane] = 0.5 * intensity.width_px;
      half_height[lane] = 0.5 * intensity.height_px;
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
  const Lanes of(intensity_sums);
  // The light as that of a disc as bright as the plateau; the edge is where u is neither 0 nor 1.
  const V radius_px = (of.weight[0] / (kFullWeight * M_PI)).sqrt();
  const V edge_px = radius_px * (1.0 - of.weight[1] / of.weight[0]);
  const Cubic<V> cubic = weights_for(radius_px, edge_px);
  const V weight = cubic.of(of.weight), cubic_x = cubic.of(of.x) / weight, cubic_y = cubic.of(of.y) / weight;
  // A cubic that is below 0 somewhere may leave nothing of what is no disc; u itself always leaves a middle.
  const auto is_inside = cubic_x.abs() <= of.half_width && cubic_y.abs() <= of.half_height;
  const V x = is_inside.select(cubic_x, of.x[0] / of.weight[0]), y = is_inside.select(cubic_y, of.y[0] / of.weight[0]);
  // Pixel i, off by the noise, moves the centroid by slope_i (x_i - x) noise / weight; the mean of both axes. The
  // weights in use do as well as 3u^2 - 2u^3 to some percent, whose slopes are simple. What slopes lies about the
  // radius from the middle: in the mean of squares over a rim, of an ellipse as large as the light.
  const V stretch = 0.5 * (of.roundness + 1.0 / of.roundness.max(kLeastRoundness));
  const V lever = of.slope2 * radius_px * radius_px * stretch;
  const V smooth = 3.0 * of.weight[1] - 2.0 * of.weight[2];
  const V moved = grey_levels.noise * kSlopeOfSum / of.span * (0.5 * lever).max(0.0).sqrt() / smooth;
  // The edge of a small disc measures less: there is more of it inside than the middle has room for.
  const V narrow_px = (kSampledEdge_px - kEdgeOfSmall_px2 / radius_px - edge_px).max(0.0);
  const V by_noise_px = (1.0 + kNarrowLoss * narrow_px) * moved, by_grid_px = kGridSigma_px * narrow_px / radius_px;
  const V sigma_px = (by_noise_px * by_noise_px + by_grid_px * by_grid_px).sqrt();
  // What is no disc may have no slope at all: then its size is all that is known.
  const V known_px =
      (sigma_px > 0.0 && sigma_px.isFinite()).select(sigma_px, kUnknownCentroidSigma * (of.bright / M_PI).sqrt());
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
