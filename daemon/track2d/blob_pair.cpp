#include "track2d/blob_pair.h"

#include <algorithm>
#include <cmath>

namespace mocap::track2d {
namespace {

using filter::Vector;

// A marker disappears in one of a hundred images, and might be anywhere in some dozen px^2.
constexpr double kHiddenCost = 12.0;
// One that was hidden stays so in nineteen of twenty.
constexpr double kStillHiddenCost = kHiddenCost - 9.0;
// An area tells that much of itself: pixel grid, blur, perspective.
constexpr double kRelativeAreaSigma = 0.08;
// How far area and elongation of a union tell the distance of its discs, in radii.
constexpr double kShapeSigma = 0.08;
// The middle of a union is the middle of its markers, save for their different sizes.
constexpr double kUnionCentreSigma_px = 0.2;
// Markers that meet may change their motion: a share of the first guess's variance.
constexpr double kMergeAgility = 0.05;
// Stories that agree to that are one.
constexpr double kDuplicateDistance_px = 0.3;

double penalty(double share) { return share <= 0.0 ? 0.0 : share * share / (kRelativeAreaSigma * kRelativeAreaSigma); }

/// Standard deviation of the centroid of a blob that is smaller than its marker's: of a disc cut in half the middle is
/// 0.42 radii off, of one that misses a tenth 0.08.
double occluded_sigma_px(const Blob& blob, double whole_area_px2) {
  constexpr double kSurelyLess = 0.05;
  const double hidden = 1.0 - blob.area_px2 / whole_area_px2;
  if (!(hidden > kSurelyLess)) return blob.sigma_px;
  return std::hypot(blob.sigma_px, 0.85 * hidden * std::sqrt(whole_area_px2 / M_PI));
}

}  // namespace

OccludedDisc estimate_occluded_disc(const Blob& blob, double whole_area_px2, const Vector<2>& expected_px,
                                    const geometry::CutDisc& cut) {
  // What pixels leave of the elongation of a few dozen of them.
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
  for (auto& filter : hypotheses_[0].filter) filter.expect_changes(kMergeAgility);
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
  // From two radii on the area says nothing more.
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
  const double both = penalty(1.0 - blob.area_px2 / largest);
  for (const Hypothesis& hypothesis : hypotheses_) {
    add(hypothesis, &ends[0], &ends[1], both, next);
    add(hypothesis, &ends[1], &ends[0], both, next);
    for (const int seen : {0, 1}) {
      const double whole = members_[seen].area_px2;
      const double part = occluded_sigma_px(blob, whole);
      const Sighting alone{blob.centroid.v, part * part, index};
      const bool was_hidden = hypothesis.filter[1 - seen].since_seen_s() > 1.5 * dt_s_;
      const double cost = (was_hidden ? kStillHiddenCost : kHiddenCost) + penalty(blob.area_px2 / whole - 1.0);
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
        cost += penalty(blob.area_px2 / members_[m].area_px2 - 1.0);
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
    const bool other_way = hypothesis.blob[0] != best.blob[0] || hypothesis.blob[1] != best.blob[1];
    if (other_way) runner_up_margin_ = std::min(runner_up_margin_, hypothesis.cost - best.cost);
    const bool is_known = std::ranges::any_of(hypotheses_, [&](const Hypothesis& existing) {
      return same(existing.filter[0], hypothesis.filter[0]) && same(existing.filter[1], hypothesis.filter[1]);
    });
    if (!is_known) hypotheses_.push_back(hypothesis);
  }
  const double least = hypotheses_[0].cost;
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.cost -= least;
}

}  // namespace mocap::track2d
