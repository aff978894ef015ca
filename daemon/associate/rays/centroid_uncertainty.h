#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/blob.h"

namespace mocap::associate {

/// The standard deviation of a marker's position from the centroid of its blob, px, each axis: the detector's sigma_px
/// and the uncertainty from the shape of the blob.
///
/// Two markers that overlap or nearly touch in the image form one blob, whose centroid lies between them. For two equal
/// discs at a distance of 2 d, the second moment along the connecting line exceeds the one across it by d^2; so area
/// and roundness give d, the offset of the centroid from either marker. A single marker is a disc, except for the
/// effect of the pixel grid.
double centroid_sigma_px(const Blob& blob);
/// The same, if the `spread_px` of the blob is known.
inline double centroid_sigma_px(const Blob& blob, double spread_px) {
  // Lower bound of the detector's sigma_px: the Cramer-Rao bound of a typical blob is 0.0093 px. Avoids division by
  // zero.
  constexpr double kMinCentroidSigma_px = 0.01;
  // Share of the squared offset that is used as variance. The offset of a merged pair is nearly deterministic, so a
  // gate of 3.5 sigma need not contain three offsets. Chosen by hand; not yet measured.
  constexpr double kOffsetVarianceShare = 0.67;
  const double sigma_px = std::max(blob.sigma_px, kMinCentroidSigma_px);
  return spread_px > 0.0 ? std::sqrt(sigma_px * sigma_px + kOffsetVarianceShare * spread_px * spread_px) : sigma_px;
}

/// Difference of the squared half axes of a single disc that the pixel grid alone can cause: 99.9 % of a million
/// rendered discs of 15 px^2 had less than 2.2 px^2.
inline constexpr double kGridInertia_px2 = 2.3;

/// Whether the blob is as round as a single marker, so that its `spread_px` is 0. Needs no root and no division.
inline bool is_round(const Blob& blob) {
  const double roundness = std::clamp(blob.roundness, 0.05, 1.0);
  return !(blob.area_px2 * (1.0 - roundness * roundness) > std::numbers::pi * kGridInertia_px2 * roundness);
}

/// The possible offset of a marker from the centroid of a blob that is much larger than the typical blob of its image,
/// px; 0 for a blob of usual size. Three or more markers can form a round blob.
double crowd_offset_px(const Blob& blob, double typical_area_px2);

/// Whether any blob of an image can have a `crowd_offset_px`, whatever the typical area is: a test without the median.
bool may_contain_crowd(double least_area_px2, double most_area_px2);

/// The rms distance of the markers of a merged blob from its centroid, px, estimated from its shape; 0 for a blob that
/// is as round as a single marker.
double spread_px(const Blob& blob);

}  // namespace mocap::associate
