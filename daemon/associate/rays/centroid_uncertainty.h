#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/blob.h"

namespace mocap::associate {

/// How well a blob tells where the marker is, px, each axis: its own sigma_px, and what its shape casts doubt on.
///
/// Where two markers overlap in an image, or nearly touch, they are one blob, whose centroid lies between them. Of two
/// like discs that lie 2 d apart the inertia along exceeds that across by d^2, so that area and roundness tell d, which
/// is how far the centroid is off either marker. A lone marker is a disc but for the pixels' grid.
double centroid_sigma_px(const Blob& blob);
/// The same, where its `spread_px` is known.
inline double centroid_sigma_px(const Blob& blob, double spread_px) {
  // A detector that promises more than this promises too much; and nothing divides by zero.
  constexpr double kMinCentroidSigma_px = 0.01;
  // Share of the squared offset that counts: the offset is nearly the same for every merged pair of its shape, so that
  // gates of 3.5 deviations need not hold three of it.
  constexpr double kOffsetVarianceShare = 0.67;
  const double sigma_px = std::max(blob.sigma_px, kMinCentroidSigma_px);
  return spread_px > 0.0 ? std::sqrt(sigma_px * sigma_px + kOffsetVarianceShare * spread_px * spread_px) : sigma_px;
}

/// By so much the grid of pixels lets the squared half axes of a disc differ: 99.9 % of a million lone discs of 15 px^2
/// had less than 2.2 px^2.
inline constexpr double kGridInertia_px2 = 2.3;

/// Whether the blob is as round as a lone marker's, so that its `spread_px` is 0: told without root or division.
inline bool is_round(const Blob& blob) {
  const double roundness = std::clamp(blob.roundness, 0.05, 1.0);
  return !(blob.area_px2 * (1.0 - roundness * roundness) > std::numbers::pi * kGridInertia_px2 * roundness);
}

/// How far off the centroid of a blob may be that is much larger than the blobs of lone markers in its image; 0 where
/// it is not. A crowd of three or more may be as round as one.
double crowd_offset_px(const Blob& blob, double typical_area_px2);

/// Whether any blob can be such a crowd, whichever is the usual area: where none is much larger than the smallest,
/// nobody needs to know it.
bool may_contain_crowd(double least_area_px2, double most_area_px2);

/// How far the markers of a merged blob lie from its centroid, px, root of the mean square, as far as its shape tells;
/// 0 for a blob that is as round as a lone marker's.
double spread_px(const Blob& blob);

}  // namespace mocap::associate
