#include "associate/predicted/merged_blob_resolver.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace mocap::associate {
namespace {

using Eigen::Vector2d;

// Standard deviation of the predicted position of a marker relative to its neighbours: a share of their distance and at
// least the minimum. Chosen by hand; not yet measured.
constexpr double kMinPositionSigma_px = 0.25;
constexpr double kRelativeSigma = 0.2;
// Two markers nearer than this form a blob as round as a single marker. Chosen by hand; not yet measured.
constexpr double kCoincidenceRadius_px = 1.5;
// Bounds of the allowed distance of a prediction beyond the extent of the blob. Chosen by hand; not yet measured.
constexpr double kMinSlack_px = 1.0;
constexpr double kMaxSlack_px = 4.0;
// Uncertainty of the spread that the shape of a blob gives: pixel grid, overlap, unequal sizes. Chosen by hand; not yet
// measured.
constexpr double kSpreadSigma_px = 0.4;
constexpr double kRelativeSpreadSigma = 0.15;
// Chi-square gate of mean and spread, 4 degrees of freedom, 96 %: one true group in 25 is rejected.
constexpr double kMaxMisfit = 10.0;

// The elongation of a set of points: second moment along a direction minus the one across it, as a vector at twice the
// angle. Contributions in opposite directions add up, contributions at right angles cancel.
Vector2d elongation(const Vector2d& off_px) {
  return {off_px.x() * off_px.x() - off_px.y() * off_px.y(), 2.0 * off_px.x() * off_px.y()};
}

struct HalfRotation {
  double cosine = 1.0;
  double sine = 0.0;
};

// Half of the angle between an elongation of norm `length` and the direction `to`; the identity if one of them is zero.
// `to` is a unit vector or zero.
HalfRotation half_rotation(const Vector2d& from, double length, const Vector2d& to) {
  if (!(length > 0.0) || to.isZero()) return {};
  const double cosine = std::clamp(from.dot(to) / length, -1.0, 1.0);
  const double across = from.x() * to.y() - from.y() * to.x();
  return {std::sqrt(0.5 * (1.0 + cosine)), std::copysign(std::sqrt(0.5 * (1.0 - cosine)), across)};
}

// Whether a non-empty set of bits has exactly one element, or exactly two.
bool is_one(std::uint32_t bits) { return (bits & (bits - 1)) == 0; }
bool is_pair(std::uint32_t bits) { return !is_one(bits) && is_one(bits & (bits - 1)); }

// Markers of equal size lie within twice their spread of the centroid of their merged blob.
double reach_px(double spread_px) { return 2.0 * spread_px; }

}  // namespace

MergedBlobResolver::MergedBlobResolver(std::size_t max_markers) { merge_candidates_.reserve(max_markers); }

bool MergedBlobResolver::resolve(const ViewRays& view, const RayBins& bins, const PredictedMeasurements& predicted,
                                 RayAssignments& assigned) {
  bool shared = false;
  gather_merge_candidates(view, bins, predicted, assigned);
  for (std::size_t first = 0; first < merge_candidates_.size();) {
    const std::uint32_t ray = merge_candidates_[first].ray;
    std::size_t last = first;
    while (last < merge_candidates_.size() && merge_candidates_[last].ray == ray) ++last;
    const Group group = group_of(std::span(merge_candidates_).subspan(first, last - first), assigned);
    first = last;
    if (group.size < 2) continue;
    if (view.spread_px[ray] > 0.0) {
      const BlobShape measured{{view.x(ray), view.y(ray)}, view.axis(ray), view.spread_px[ray]};
      const SubsetFit fit = best_subset(view, predicted, measured, group);
      if (fit.subset == 0) continue;
      split(view, predicted, assigned, ray, measured, group, fit);
      shared = true;
    } else if (group.has_assigned) {
      shared = assign_occluded(predicted, assigned, ray, group, view.focal_px) || shared;
    }
  }
  return shared;
}

// Each marker without a ray is a candidate for the blob whose extent contains its prediction or is nearest to its
// prediction.
void MergedBlobResolver::gather_merge_candidates(const ViewRays& view, const RayBins& bins,
                                                 const PredictedMeasurements& predicted,
                                                 const RayAssignments& assigned) {
  merge_candidates_.clear();
  const auto slack_px = [&](std::uint32_t m) {
    return std::clamp(2.0 * predicted.sigma_px(m, view.focal_px), kMinSlack_px, kMaxSlack_px);
  };
  const double coincidence2 = kCoincidenceRadius_px * kCoincidenceRadius_px / (view.focal_px * view.focal_px);
  const std::span<const std::uint32_t> rays = assigned.rays();
  for (std::uint32_t m = 0; m < rays.size(); ++m) {
    if (rays[m] != AssignedRay::kNone || !predicted.usable(m)) continue;
    const Vector2d at = predicted.centre(m);
    const double slack = slack_px(m);
    const auto half =
        static_cast<float>(std::max(kCoincidenceRadius_px, slack + reach_px(view.max_spread_px())) / view.focal_px);
    std::uint32_t nearest = AssignedRay::kNone;
    double min_misfit = 0.0;
    bins.visit_near(predicted.x[m], predicted.y[m], half, [&](std::size_t ray) {
      const double spread = view.spread_px[ray];
      const double off2 = (Vector2d(view.x(ray), view.y(ray)) - at).squaredNorm();
      if (spread == 0.0 && off2 >= coincidence2) return;  // excludes most rays without a square root
      const double off_px = view.focal_px * std::sqrt(off2);
      const double over = off_px - (spread > 0.0 ? reach_px(spread) + slack : kCoincidenceRadius_px);
      if (over >= min_misfit) return;
      min_misfit = over;
      nearest = static_cast<std::uint32_t>(ray);
    });
    if (nearest != AssignedRay::kNone && merge_candidates_.size() < merge_candidates_.capacity())
      merge_candidates_.push_back({nearest, m});
  }
  std::ranges::sort(merge_candidates_, [](const MergeCandidate& a, const MergeCandidate& b) {
    return a.ray != b.ray ? a.ray < b.ray : a.marker < b.marker;
  });
}

// The candidates for one ray; the marker to which the ray is assigned comes first.
MergedBlobResolver::Group MergedBlobResolver::group_of(std::span<const MergeCandidate> merge_candidates,
                                                       const RayAssignments& assigned) {
  Group group;
  const std::uint32_t first_marker = assigned.assigned_marker(merge_candidates.front().ray);
  group.has_assigned = first_marker != AssignedRay::kNone;
  if (group.has_assigned) group.markers[group.size++] = first_marker;
  for (const MergeCandidate& merge_candidate : merge_candidates) {
    if (group.size == kMaxMergedMarkers) break;
    group.markers[group.size++] = merge_candidate.marker;
  }
  return group;
}

// The predicted arrangement of a subset of a group.
MergedBlobResolver::Layout MergedBlobResolver::layout_of(const ViewRays& view, const PredictedMeasurements& predicted,
                                                         const Group& group, std::uint32_t subset) {
  Layout layout;
  if (is_pair(subset)) {  // the usual case: both are equally far from the mean, on opposite sides
    const std::uint32_t a = group.markers[static_cast<std::size_t>(std::countr_zero(subset))];
    const std::uint32_t b = group.markers[static_cast<std::size_t>(std::bit_width(subset) - 1)];
    const Vector2d at_a = predicted.centre(a), at_b = predicted.centre(b);
    layout.mean = 0.5 * (at_a + at_b);
    const Vector2d off_px = 0.5 * view.focal_px * (at_b - at_a);
    layout.stretch_px2 = elongation(off_px);
    layout.length_px = off_px.norm();
    layout.sigma_px = 0.5 * (predicted.sigma_px(a, view.focal_px) + predicted.sigma_px(b, view.focal_px));
    return layout;
  }
  const double weight = 1.0 / std::popcount(subset);
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    layout.mean += weight * predicted.centre(group.markers[i]);
    layout.sigma_px += weight * predicted.sigma_px(group.markers[i], view.focal_px);
  }
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    const Vector2d off_px = view.focal_px * (predicted.centre(group.markers[i]) - layout.mean);
    layout.stretch_px2 += weight * elongation(off_px);
  }
  layout.length_px = std::sqrt(layout.stretch_px2.norm());
  return layout;
}

// The subset of two or more markers that explains the blob best; empty if none is inside the gate.
MergedBlobResolver::SubsetFit MergedBlobResolver::best_subset(const ViewRays& view,
                                                              const PredictedMeasurements& predicted,
                                                              const BlobShape& measured, const Group& group) {
  const double measured_px = measured.spread_px;
  const Vector2d measured_px2 = measured_px * measured_px * measured.axis;
  const double measured_sigma_px2 = kSpreadSigma_px * kSpreadSigma_px + std::pow(kRelativeSpreadSigma * measured_px, 2);
  SubsetFit best;
  double min_misfit = kMaxMisfit;
  for (std::uint32_t subset = 3; subset < (1U << group.size); ++subset) {
    if (is_one(subset) || (group.has_assigned && (subset & 1U) == 0)) continue;
    const Layout layout = layout_of(view, predicted, group, subset);
    const double mean_px2 = view.focal_px * view.focal_px * (layout.mean - measured.centroid).squaredNorm();
    const double predicted_px = layout.length_px;
    // Without an axis the lengths are compared; with an axis the squared lengths, whose errors are 2 * length times as
    // large.
    const double off_px = measured_px2.isZero()
                              ? predicted_px - measured_px
                              : (layout.stretch_px2 - measured_px2).norm() / (predicted_px + measured_px);
    const double misfit = mean_px2 / (0.25 + layout.sigma_px * layout.sigma_px) + off_px * off_px / measured_sigma_px2;
    if (misfit < min_misfit) {
      min_misfit = misfit;
      best = {subset, layout};
    }
  }
  return best;
}

// Places the markers of a subset in their blob: the order comes from the predictions, distance and direction come from
// the shape. A predicted distance would confirm itself from set to set.
void MergedBlobResolver::split(const ViewRays& view, const PredictedMeasurements& predicted, RayAssignments& assigned,
                               std::uint32_t ray, const BlobShape& measured, const Group& group, const SubsetFit& fit) {
  const auto& [subset, layout] = fit;
  const double scale = measured.spread_px / std::max(0.1, layout.length_px);
  const auto [cosine, sine] = half_rotation(layout.stretch_px2, layout.length_px * layout.length_px, measured.axis);
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    const Vector2d offset = predicted.centre(group.markers[i]) - layout.mean;
    AssignedRay& shared_place = assigned.assign_shared(group.markers[i], ray);
    const Vector2d rotated =
        scale * Vector2d(cosine * offset.x() - sine * offset.y(), sine * offset.x() + cosine * offset.y());
    shared_place.offset = rotated.cast<float>();
    const double sigma_px2 = kMinPositionSigma_px * kMinPositionSigma_px +
                             kRelativeSigma * kRelativeSigma * view.focal_px * view.focal_px * rotated.squaredNorm();
    shared_place.sigma_px = static_cast<float>(std::sqrt(sigma_px2));
  }
}

// A marker whose prediction coincides with an assigned blob is occluded or absent: both markers share the blob, with a
// larger uncertainty.
bool MergedBlobResolver::assign_occluded(const PredictedMeasurements& predicted, RayAssignments& assigned,
                                         std::uint32_t ray, const Group& group, double focal_px) {
  float widest_px = 0.0F;
  for (std::size_t i = 1; i < group.size; ++i) {
    const double apart_px = focal_px * (predicted.centre(group.markers[i]) - predicted.centre(group.markers[0])).norm();
    if (apart_px > kCoincidenceRadius_px) continue;
    AssignedRay& other = assigned.assign_shared(group.markers[i], ray);
    other.hidden = true;
    other.sigma_px = static_cast<float>(std::hypot(kMinPositionSigma_px, 0.5 * apart_px));
    widest_px = std::max(widest_px, other.sigma_px);
  }
  if (!(widest_px > 0.0F)) return false;
  assigned.assign_shared(group.markers[0], ray).sigma_px = widest_px;
  return true;
}

}  // namespace mocap::associate
