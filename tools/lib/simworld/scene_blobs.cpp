#include "lib/simworld/scene_blobs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::simworld {
namespace {

using Eigen::Vector2d;

// Measured on rendered discs, 3600 of each radius 1.5, 3 and 6 px: centroid error 0.0080, 0.0057 and 0.0042 px per
// axis; sigma_px that the detector reports 0.0071, 0.0046 and 0.0032 px.
constexpr double kError_px = 0.0098;  // centroid error, divided by the square root of the radius in px
constexpr double kSigma_px = 0.0084;  // reported sigma_px, divided in the same way
constexpr double kGlow_px = 0.72;     // the region above the threshold extends this far beyond the disc
// Two discs form one blob if their centres are closer than kOne_px + kOnePerRadius * radius. Measured limits: 3.25 px
// at radius 1.5 px, 3.8 at 2, 5.1 at 3.
constexpr double kOne_px = 1.4;
constexpr double kOnePerRadius = 1.25;
constexpr double kDoubtful_px = 0.4;  // within this distance below the limit the detector marks the blob as merged
// Up to this gap between the discs their light overlaps. The detector splits them, which increases the centroid error
// to 0.008 to 0.026 px; sigma_px is 0.03.
constexpr double kOverlap_px = 1.8;
constexpr double kCutError_px = 0.012;
constexpr double kCutSigma_px = 0.018;
constexpr double kCutSigmaPerRadius = 0.0063;
constexpr double kJoinedSigma_px = 0.018;
constexpr double kFalseLeastRadius_px = 0.8;
constexpr double kFalseRadii_px = 1.2;

// Area, centroid and second moments of a union of discs, computed on a fine grid.
struct SpotSilhouette {
  double area_px2 = 0.0;
  Vector2d centroid = Vector2d::Zero();
  double xx = 0.0, yy = 0.0, xy = 0.0;
};

SpotSilhouette silhouette_of(std::span<const Spot* const> spots) {
  constexpr double kGrid_px = 0.25;
  Vector2d low = Vector2d::Constant(1e9), high = -low;
  for (const Spot* spot : spots) {
    low = low.cwiseMin(spot->centre_px - Vector2d::Constant(spot->radius_px + kGlow_px));
    high = high.cwiseMax(spot->centre_px + Vector2d::Constant(spot->radius_px + kGlow_px));
  }
  SpotSilhouette sum;
  for (double y = 0.5 * kGrid_px; y < high.y() - low.y(); y += kGrid_px) {
    for (double x = 0.5 * kGrid_px; x < high.x() - low.x(); x += kGrid_px) {
      const Vector2d off(x, y);
      const bool lit = std::ranges::any_of(spots, [&](const Spot* spot) {
        const double radius_px = spot->radius_px + kGlow_px;
        return (low + off - spot->centre_px).squaredNorm() <= radius_px * radius_px;
      });
      if (!lit) continue;
      sum.area_px2 += 1.0;
      sum.centroid += off;
      sum.xx += x * x;
      sum.yy += y * y;
      sum.xy += x * y;
    }
  }
  const double count = std::max(1.0, sum.area_px2);
  sum.centroid /= count;
  sum.xx = sum.xx / count - sum.centroid.x() * sum.centroid.x();
  sum.yy = sum.yy / count - sum.centroid.y() * sum.centroid.y();
  sum.xy = sum.xy / count - sum.centroid.x() * sum.centroid.y();
  sum.centroid += low;
  sum.area_px2 *= kGrid_px * kGrid_px;
  return sum;
}

}  // namespace

Blob BlobMaker::alone(const Spot& spot, double added_px, double sigma_px, scene::Random& random) const {
  Blob blob;
  const double radius_px = std::max(0.5, spot.radius_px), root = std::sqrt(radius_px);
  const double error_px = noise_ * std::hypot(kError_px / root, added_px);
  const double x_px = error_px * random.normal();
  blob.centroid.v = spot.centre_px + Vector2d(x_px, error_px * random.normal());
  blob.sigma_px = noise_ * std::hypot(kSigma_px / root, sigma_px);
  blob.area_px2 = std::round(std::numbers::pi * (radius_px + kGlow_px) * (radius_px + kGlow_px));
  blob.peak = 0.95;
  blob.roundness = std::clamp(1.0 - (0.1 + 0.1 * random.uniform()) / radius_px, 0.5, 1.0);
  blob.axis_rad = std::numbers::pi * (random.uniform() - 0.5);
  return blob;
}

Blob BlobMaker::joined(std::span<const Spot* const> spots, scene::Random& random) const {
  const SpotSilhouette shape = silhouette_of(spots);
  Spot whole = *spots.front();
  whole.centre_px = shape.centroid;
  Blob blob = alone(whole, 0.0, kJoinedSigma_px, random);
  blob.area_px2 = shape.area_px2;
  const double mean = 0.5 * (shape.xx + shape.yy);
  const double half_range = std::hypot(0.5 * (shape.xx - shape.yy), shape.xy);
  blob.roundness = std::sqrt(std::clamp((mean - half_range) / (mean + half_range), 0.0, 1.0));
  blob.axis_rad = 0.5 * std::atan2(2.0 * shape.xy, shape.xx - shape.yy);
  return blob;
}

std::span<const std::uint32_t> BlobMaker::see(std::span<const Spot> spots, scene::Random& random, Blobs& into) {
  const auto count = static_cast<std::uint32_t>(spots.size());
  group_of_.resize(count);
  blob_of_.assign(count, kNone);
  touched_.assign(count, false);
  doubtful_.assign(count, false);
  for (std::uint32_t i = 0; i < count; ++i) group_of_[i] = i;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint32_t j = i + 1; j < count; ++j) {
      const double mean_px = 0.5 * (spots[i].radius_px + spots[j].radius_px);
      const double apart_px = (spots[i].centre_px - spots[j].centre_px).norm();
      if (apart_px >= 2.0 * mean_px + kOverlap_px) continue;
      touched_[i] = touched_[j] = true;
      const double one_px = kOne_px + kOnePerRadius * mean_px;
      if (apart_px >= one_px) continue;
      if (apart_px > one_px - kDoubtful_px) doubtful_[i] = doubtful_[j] = true;
      if (group_of_[i] == group_of_[j]) continue;
      std::ranges::replace(group_of_, std::uint32_t{group_of_[j]}, std::uint32_t{group_of_[i]});
    }
  }
  for (std::uint32_t group = 0; group < count; ++group) {
    members_.clear();
    bool doubtful = false;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (group_of_[i] != group) continue;
      members_.push_back(&spots[i]);
      blob_of_[i] = static_cast<std::uint32_t>(into.size());
      doubtful = doubtful || doubtful_[i];
    }
    if (members_.empty()) continue;
    Blob blob;
    if (members_.size() > 1) {
      blob = joined(members_, random);
      blob.merged = doubtful;
    } else {
      const Spot& spot = *members_.front();
      const bool cut = touched_[static_cast<std::size_t>(&spot - spots.data())];
      blob =
          alone(spot, cut ? kCutError_px : 0.0, cut ? kCutSigma_px + kCutSigmaPerRadius * spot.radius_px : 0.0, random);
    }
    if (into.try_push_back(blob)) continue;
    for (std::uint32_t i = 0; i < count; ++i) blob_of_[i] = group_of_[i] == group ? kNone : blob_of_[i];
  }
  return blob_of_;
}

void BlobMaker::add_false(int width_px, int height_px, scene::Random& random, Blobs& into) const {
  Spot spot;
  const double x_px = random.uniform() * width_px;
  spot.centre_px = {x_px, random.uniform() * height_px};
  spot.radius_px = kFalseLeastRadius_px + kFalseRadii_px * random.uniform();
  static_cast<void>(into.try_push_back(alone(spot, 0.0, 0.0, random)));
}

}  // namespace mocap::simworld
