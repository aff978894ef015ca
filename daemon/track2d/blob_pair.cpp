#include "track2d/blob_pair.h"

#include <algorithm>
#include <cmath>

namespace mocap::track2d {
namespace {

using filter::Vector;

// Costs are -2 ln of a likelihood, without the constant 2 ln(2 pi) (see innovation_cost). A marker disappears in one of
// 100 images; the cost replaces that of a measurement with a uniform density over about 25 px^2.
constexpr double kHiddenCost = 12.0;
// A marker that was hidden stays hidden with a probability of 19 in 20.
constexpr double kStillHiddenCost = kHiddenCost - 9.0;
// Relative standard deviation of a blob's area: pixel grid, blur, perspective.
constexpr double kRelativeAreaSigma = 0.08;
// Standard deviation of the distance of two discs by area and elongation of their union, in radii.
constexpr double kShapeSigma = 0.08;
// Standard deviation of the centre of two markers by the centroid of their union: the discs may differ in size.
constexpr double kUnionCentreSigma_px = 0.2;
// Markers that meet may change their motion: smallest process noise scale of the filters when a pair begins.
constexpr double kMergeNoiseScale = 0.05;
// Hypotheses whose positions, now and in the next image, agree to this are merged.
constexpr double kDuplicateDistance_px = 0.3;

// Cost of a relative area error; negative errors have none.
double area_cost(double error) {
  return error <= 0.0 ? 0.0 : error * error / (kRelativeAreaSigma * kRelativeAreaSigma);
}

// Standard deviation of the centroid of a blob that may be smaller than its marker: the centroid of half a disc is 0.42
// radii from the centre, that of a disc without a tenth of its area 0.08 radii.
double occluded_sigma_px(const Blob& blob, double whole_area_px2) {
  constexpr double kMinHiddenFraction = 0.05;  // below it, the blob counts as complete
  const double hidden = 1.0 - blob.area_px2 / whole_area_px2;
  if (!(hidden > kMinHiddenFraction)) return blob.sigma_px;
  return std::hypot(blob.sigma_px, 0.85 * hidden * std::sqrt(whole_area_px2 / M_PI));
}

}  // namespace

OccludedDisc estimate_occluded_disc(const Blob& blob, double whole_area_px2, const Vector<2>& expected_px,
                                    const geometry::CutDisc& cut) {
  // Standard deviation of the roundness of a blob of some dozen pixels.
  constexpr double kRoundnessSigma = 0.12;
  const double radius = std::sqrt(whole_area_px2 / M_PI);
  const geometry::CutDisc::Shape shape = cut.shape(blob.area_px2 / whole_area_px2);
  const double offset = radius * shape.offset;
  if (!std::isfinite(blob.axis_rad) || std::abs(blob.roundness - shape.roundness) > kRoundnessSigma) {
    return {blob.centroid.v, std::hypot(blob.sigma_px, offset)};
  }
  Vector<2> across(-std::sin(blob.axis_rad), std::cos(blob.axis_rad));
  if (across.dot(expected_px - blob.centroid.v) < 0.0) across = -across;
  return {blob.centroid.v + offset * across, std::hypot(blob.sigma_px, 0.25 * offset, 0.02 * radius)};
}

BlobPair::BlobPair(const filter::IsotropicKalman<2>& first, const filter::IsotropicKalman<2>& second, const Member& one,
                   const Member& other)
    : members_{one, other} {
  hypotheses_.push_back({{first, second}, {kNone, kNone}, 0.0});
  for (auto& filter : hypotheses_[0].filter) filter.expect_changes(kMergeNoiseScale);
}

bool BlobPair::same(const filter::IsotropicKalman<2>& a, const filter::IsotropicKalman<2>& b) const {
  constexpr double kDuplicateDistance2_px2 = kDuplicateDistance_px * kDuplicateDistance_px;
  return (a.motion().point - b.motion().point).squaredNorm() < kDuplicateDistance2_px2 &&
         (a.motion().velocity - b.motion().velocity).squaredNorm() * dt_s_ * dt_s_ < kDuplicateDistance2_px2;
}

void BlobPair::predict(double dt_s) {
  dt_s_ = dt_s;
  for (Hypothesis& hypothesis : hypotheses_) {
    for (auto& filter : hypothesis.filter) filter.predict(dt_s);
  }
}

void BlobPair::see_none() {
  images_separate_ = 0;
  Hypotheses next;
  for (const Hypothesis& hypothesis : hypotheses_) add(hypothesis, nullptr, nullptr, 0.0, next);
  prune_hypotheses(next);
}

void BlobPair::see_one(const Blob& blob, std::uint32_t index, const geometry::TwoDiscs& discs) {
  images_separate_ = 0;
  Hypotheses next;
  const double one_area = 0.5 * (members_[0].area_px2 + members_[1].area_px2);
  const double radius = std::sqrt(one_area / M_PI);
  const double by_area = radius * discs.distance_from_area(blob.area_px2 / one_area);
  const double by_shape = radius * discs.distance_from_roundness(blob.roundness);
  // From a distance of two radii on, the area is constant and does not determine the distance.
  const double distance = by_area > 1.9 * radius ? std::max(by_area, by_shape) : 0.5 * (by_area + by_shape);
  const double distance_mismatch = by_area > 1.9 * radius ? 0.0 : 0.5 * (by_area - by_shape);
  const double area_mismatch = std::abs(members_[0].area_px2 - members_[1].area_px2) / one_area;
  const double sigma = std::hypot(kShapeSigma * radius, distance_mismatch, 0.25 * area_mismatch * radius);
  const double angle = std::isfinite(blob.axis_rad) ? blob.axis_rad : 0.0;
  const Vector<2> half = 0.5 * distance * Vector<2>(std::cos(angle), std::sin(angle));
  const double variance =
      blob.sigma_px * blob.sigma_px + kUnionCentreSigma_px * kUnionCentreSigma_px + 0.25 * sigma * sigma;
  const Sighting ends[2] = {{blob.centroid.v - half, variance, index}, {blob.centroid.v + half, variance, index}};
  const double largest = std::max(members_[0].area_px2, members_[1].area_px2);
  const double merged_cost = area_cost(1.0 - blob.area_px2 / largest);
  for (const Hypothesis& hypothesis : hypotheses_) {
    add(hypothesis, &ends[0], &ends[1], merged_cost, next);
    add(hypothesis, &ends[1], &ends[0], merged_cost, next);
    for (const int seen : {0, 1}) {
      const double whole = members_[seen].area_px2;
      const double part = occluded_sigma_px(blob, whole);
      const Sighting alone{blob.centroid.v, part * part, index};
      const bool was_hidden = hypothesis.filter[1 - seen].since_seen_s() > 1.5 * dt_s_;
      const double cost = (was_hidden ? kStillHiddenCost : kHiddenCost) + area_cost(blob.area_px2 / whole - 1.0);
      add(hypothesis, seen == 0 ? &alone : nullptr, seen == 1 ? &alone : nullptr, cost, next);
    }
  }
  prune_hypotheses(next);
}

void BlobPair::see_two(std::span<const Blob* const, 2> blobs, std::span<const std::uint32_t, 2> indices) {
  ++images_separate_;
  Hypotheses next;
  for (const Hypothesis& hypothesis : hypotheses_) {
    for (const std::size_t first : {std::size_t{0}, std::size_t{1}}) {
      const std::size_t of[2] = {first, 1 - first};
      Sighting seen[2];
      double cost = 0.0;
      for (const std::size_t m : {std::size_t{0}, std::size_t{1}}) {
        const Blob& blob = *blobs[of[m]];
        const double sigma = occluded_sigma_px(blob, members_[m].area_px2);
        seen[m] = {blob.centroid.v, sigma * sigma, indices[of[m]]};
        cost += area_cost(blob.area_px2 / members_[m].area_px2 - 1.0);
      }
      add(hypothesis, &seen[0], &seen[1], std::min(cost, kHiddenCost), next);
    }
  }
  prune_hypotheses(next);
}

void BlobPair::add(const Hypothesis& from, const Sighting* first, const Sighting* second, double cost, Hypotheses& to) {
  Hypothesis hypothesis = from;
  hypothesis.cost += cost;
  const Sighting* const seen[2] = {first, second};
  for (const int m : {0, 1}) {
    hypothesis.blob[m] = seen[m] != nullptr ? seen[m]->blob : kNone;
    filter::IsotropicKalman<2>& filter = hypothesis.filter[m];
    if (seen[m] == nullptr) {
      filter.coast();
      continue;
    }
    const filter::Motion<2>& motion = filter.motion();
    hypothesis.cost +=
        filter::innovation_cost<2>((seen[m]->point_px - motion.point).squaredNorm(), motion.pp + seen[m]->variance_px2);
    filter.update(seen[m]->point_px, seen[m]->variance_px2);
  }
  to.push_back(hypothesis);
}

void BlobPair::prune_hypotheses(const Hypotheses& next) {
  std::uint32_t order[4 * kMaxHypotheses];
  for (std::uint32_t i = 0; i < next.size(); ++i) order[i] = i;
  std::sort(order, order + next.size(), [&next](std::uint32_t a, std::uint32_t b) {
    return next[a].cost != next[b].cost ? next[a].cost < next[b].cost : a < b;
  });
  hypotheses_.clear();
  const Hypothesis& best = next[order[0]];
  runner_up_margin_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < next.size() && !hypotheses_.full(); ++i) {
    const Hypothesis& hypothesis = next[order[i]];
    const bool differs = hypothesis.blob[0] != best.blob[0] || hypothesis.blob[1] != best.blob[1];
    if (differs) runner_up_margin_ = std::min(runner_up_margin_, hypothesis.cost - best.cost);
    const bool is_known = std::ranges::any_of(hypotheses_, [&](const Hypothesis& existing) {
      return same(existing.filter[0], hypothesis.filter[0]) && same(existing.filter[1], hypothesis.filter[1]);
    });
    if (!is_known) hypotheses_.push_back(hypothesis);
  }
  const double least = hypotheses_[0].cost;
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.cost -= least;
}

}  // namespace mocap::track2d
