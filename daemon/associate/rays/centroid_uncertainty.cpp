#include "associate/rays/centroid_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::associate {
namespace {

// For discs above this area the effect of the pixel grid on the moments grows with the radius. Chosen by hand; not yet
// measured.
constexpr double kSmallDisc_px2 = 25.0;
// True offset over the offset from the moments, as a linear function of (offset / radius of one disc): fitted to merged
// pairs of rendered discs with offsets of 0.5 to 3 px.
constexpr double kSpreadScale = 0.84;
constexpr double kSpreadSlope = 0.39;
// A blob whose area exceeds the typical area by this factor contains several markers, even if it is round. Chosen by
// hand; not yet measured.
constexpr double kCrowdAreaRatio = 2.2;

}  // namespace

double centroid_sigma_px(const Blob& blob) { return centroid_sigma_px(blob, spread_px(blob)); }

double crowd_offset_px(const Blob& blob, double typical_area_px2) {
  if (!(blob.area_px2 > kCrowdAreaRatio * typical_area_px2)) return 0.0;
  return std::sqrt(blob.area_px2 / std::numbers::pi) - std::sqrt(typical_area_px2 / std::numbers::pi);
}

bool may_contain_crowd(double least_area_px2, double most_area_px2) {
  return most_area_px2 > kCrowdAreaRatio * least_area_px2;
}

double spread_px(const Blob& blob) {
  if (is_round(blob)) return 0.0;
  // An ellipse with half axes a >= b has area pi a b and roundness b / a; its second moment along an axis is a^2 / 4.
  const double roundness = std::clamp(blob.roundness, 0.05, 1.0);
  const double grid_px2 = kGridInertia_px2 * std::sqrt(std::max(1.0, blob.area_px2 / kSmallDisc_px2));
  const double longer_px2 = blob.area_px2 / std::numbers::pi * (1.0 / roundness - roundness);
  // Two discs cover less area than the ellipse with their moments, and the difference grows with their distance:
  // kSpreadScale corrects it.
  const double half_distance_px = 0.5 * std::sqrt(longer_px2 - grid_px2);
  const double radius_px = std::sqrt(blob.area_px2 / (2.0 * std::numbers::pi));
  return half_distance_px * (kSpreadScale + kSpreadSlope * half_distance_px / radius_px);
}

}  // namespace mocap::associate
