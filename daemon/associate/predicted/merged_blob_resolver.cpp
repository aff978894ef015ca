#include "associate/predicted/merged_blob_resolver.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace mocap::associate {
namespace {

using Eigen::Vector2d;

// Standard deviation of where a marker is foreseen beside its neighbours: a share of their distance, and at least this.
constexpr double kLeastSigma_px = 0.25;
constexpr double kSigmaShare = 0.2;
// Markers that nearly coincide make a blob as round as a lone one; within this they are taken for one.
constexpr double kCoincide_px = 1.5;
// How far a foreseen place may be off beyond the blob's own extent.
constexpr double kLeastSlack_px = 1.0;
constexpr double kMostSlack_px = 4.0;
// The shape tells the spread of markers to so much: pixels' grid, overlap, unlike distances.
constexpr double kSpreadSigma_px = 0.4;
constexpr double kSpreadShare = 0.15;
// Squared deviations of mean and spread together, 4 degrees of freedom: 1 in 25 true ones is refused.
constexpr double kMostMisfit = 10.0;

// The inertia along a direction beyond that across it, with twice the angle: what stretches in opposite directions has
// in common adds up, what is at right angles cancels.
Vector2d elongation(const Vector2d& off_px) {
  return {off_px.x() * off_px.x() - off_px.y() * off_px.y(), 2.0 * off_px.x() * off_px.y()};
}

struct Turn {
  double cosine = 1.0;
  double sine = 0.0;
};

// Half of the angle from a stretch of that length to a direction (unit, or zero), so at most a quarter turn; none where
// a direction is not told.
Turn half_turn(const Vector2d& from, double length, const Vector2d& to) {
  if (!(length > 0.0) || to.isZero()) return {};
  const double cosine = std::clamp(from.dot(to) / length, -1.0, 1.0);
  const double across = from.x() * to.y() - from.y() * to.x();
  return {std::sqrt(0.5 * (1.0 + cosine)), std::copysign(std::sqrt(0.5 * (1.0 - cosine)), across)};
}

// Sets of bits, one or more: of one, of two.
bool is_one(std::uint32_t bits) { return (bits & (bits - 1)) == 0; }
bool is_pair(std::uint32_t bits) { return !is_one(bits) && is_one(bits & (bits - 1)); }

// A blob of several like markers reaches no further from its centroid than twice their spread.
double reach_px(double spread_px) { return 2.0 * spread_px; }

}  // namespace

BlobSharer::BlobSharer(std::size_t max_markers) { wishes_.reserve(max_markers); }

bool BlobSharer::share(const ViewRays& view, const RayBins& bins, const Foreseen& foreseen, ViewHolds& held) {
  bool shared = false;
  gather_wishes(view, bins, foreseen, held);
  for (std::size_t first = 0; first < wishes_.size();) {
    const std::uint32_t ray = wishes_[first].ray;
    std::size_t last = first;
    while (last < wishes_.size() && wishes_[last].ray == ray) ++last;
    const Group group = group_of(std::span(wishes_).subspan(first, last - first), held);
    first = last;
    if (group.size < 2) continue;
    if (view.spread_px[ray] > 0.0) {
      const Told told{{view.x(ray), view.y(ray)}, view.axis(ray), view.spread_px[ray]};
      const Explained explained = best_subset(view, foreseen, told, group);
      if (explained.subset == 0) continue;
      split(view, foreseen, held, ray, told, group, explained);
      shared = true;
    } else if (group.has_owner) {
      shared = overlay(foreseen, held, ray, group, view.focal_px) || shared;
    }
  }
  return shared;
}

// Each marker without a ray wishes for the blob that it should lie in, or nearest to.
void BlobSharer::gather_wishes(const ViewRays& view, const RayBins& bins, const Foreseen& foreseen,
                               const ViewHolds& held) {
  wishes_.clear();
  const auto slack_px = [&](std::uint32_t m) {
    return std::clamp(2.0 * foreseen.sigma_px(m, view.focal_px), kLeastSlack_px, kMostSlack_px);
  };
  const double coincide2 = kCoincide_px * kCoincide_px / (view.focal_px * view.focal_px);
  const std::span<const std::uint32_t> rays = held.rays();
  for (std::uint32_t m = 0; m < rays.size(); ++m) {
    if (rays[m] != Held::kNone || !foreseen.usable(m)) continue;
    const Vector2d at = foreseen.centre(m);
    const double slack = slack_px(m);
    const auto half =
        static_cast<float>(std::max(kCoincide_px, slack + reach_px(view.max_spread_px())) / view.focal_px);
    std::uint32_t nearest = Held::kNone;
    double least = 0.0;
    bins.visit_near(foreseen.x[m], foreseen.y[m], half, [&](std::size_t ray) {
      const double spread = view.spread_px[ray];
      const double off2 = (Vector2d(view.x(ray), view.y(ray)) - at).squaredNorm();
      if (spread == 0.0 && off2 >= coincide2) return;  // most rays, without the root
      const double off_px = view.focal_px * std::sqrt(off2);
      const double over = off_px - (spread > 0.0 ? reach_px(spread) + slack : kCoincide_px);
      if (over >= least) return;
      least = over;
      nearest = static_cast<std::uint32_t>(ray);
    });
    if (nearest != Held::kNone && wishes_.size() < wishes_.capacity()) wishes_.push_back({nearest, m});
  }
  std::ranges::sort(wishes_,
                    [](const Wish& a, const Wish& b) { return a.ray != b.ray ? a.ray < b.ray : a.marker < b.marker; });
}

// Those who wish for one ray, and before them who holds it.
BlobSharer::Group BlobSharer::group_of(std::span<const Wish> wishes, const ViewHolds& held) {
  Group group;
  const std::uint32_t owner = held.holder(wishes.front().ray);
  group.has_owner = owner != Held::kNone;
  if (group.has_owner) group.markers[group.size++] = owner;
  for (const Wish& wish : wishes) {
    if (group.size == kMaxSharers) break;
    group.markers[group.size++] = wish.marker;
  }
  return group;
}

// How the foreseen markers of a subset lie.
BlobSharer::Layout BlobSharer::layout_of(const ViewRays& view, const Foreseen& foreseen, const Group& group,
                                         std::uint32_t subset) {
  Layout layout;
  if (is_pair(subset)) {  // most are: both lie as far from the mean, to opposite sides
    const std::uint32_t a = group.markers[static_cast<std::size_t>(std::countr_zero(subset))];
    const std::uint32_t b = group.markers[static_cast<std::size_t>(std::bit_width(subset) - 1)];
    const Vector2d at_a = foreseen.centre(a), at_b = foreseen.centre(b);
    layout.mean = 0.5 * (at_a + at_b);
    const Vector2d off_px = 0.5 * view.focal_px * (at_b - at_a);
    layout.stretch_px2 = elongation(off_px);
    layout.length_px = off_px.norm();
    layout.sigma_px = 0.5 * (foreseen.sigma_px(a, view.focal_px) + foreseen.sigma_px(b, view.focal_px));
    return layout;
  }
  const double share = 1.0 / std::popcount(subset);
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    layout.mean += share * foreseen.centre(group.markers[i]);
    layout.sigma_px += share * foreseen.sigma_px(group.markers[i], view.focal_px);
  }
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    const Vector2d off_px = view.focal_px * (foreseen.centre(group.markers[i]) - layout.mean);
    layout.stretch_px2 += share * elongation(off_px);
  }
  layout.length_px = std::sqrt(layout.stretch_px2.norm());
  return layout;
}

// The two or more of the group that explain the blob best, as a set of bits; none where none do.
BlobSharer::Explained BlobSharer::best_subset(const ViewRays& view, const Foreseen& foreseen, const Told& told,
                                              const Group& group) {
  const double told_px = told.spread_px;
  const Vector2d told_px2 = told_px * told_px * told.axis;
  const double told_sigma_px2 = kSpreadSigma_px * kSpreadSigma_px + std::pow(kSpreadShare * told_px, 2);
  Explained best;
  double least = kMostMisfit;
  for (std::uint32_t subset = 3; subset < (1U << group.size); ++subset) {
    if (is_one(subset) || (group.has_owner && (subset & 1U) == 0)) continue;
    const Layout layout = layout_of(view, foreseen, group, subset);
    const double mean_px2 = view.focal_px * view.focal_px * (layout.mean - told.centroid).squaredNorm();
    const double foreseen_px = layout.length_px;
    // Without an axis the length alone is compared; with one, the squares, whose errors are twice the length's.
    const double off_px =
        told_px2.isZero() ? foreseen_px - told_px : (layout.stretch_px2 - told_px2).norm() / (foreseen_px + told_px);
    const double misfit = mean_px2 / (0.25 + layout.sigma_px * layout.sigma_px) + off_px * off_px / told_sigma_px2;
    if (misfit < least) {
      least = misfit;
      best = {subset, layout};
    }
  }
  return best;
}

// Which of them is on which side is foreseen; how far apart and in which direction they are is what the shape tells. A
// distance that was foreseen would confirm itself from set to set.
void BlobSharer::split(const ViewRays& view, const Foreseen& foreseen, ViewHolds& held, std::uint32_t ray,
                       const Told& told, const Group& group, const Explained& explained) {
  const auto& [subset, layout] = explained;
  const double scale = told.spread_px / std::max(0.1, layout.length_px);
  const auto [cosine, sine] = half_turn(layout.stretch_px2, layout.length_px * layout.length_px, told.axis);
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((subset >> i & 1U) == 0) continue;
    const Vector2d off = foreseen.centre(group.markers[i]) - layout.mean;
    Held& own = held.share(group.markers[i], ray);
    const Vector2d turned = scale * Vector2d(cosine * off.x() - sine * off.y(), sine * off.x() + cosine * off.y());
    own.off = turned.cast<float>();
    const double sigma_px2 = kLeastSigma_px * kLeastSigma_px +
                             kSigmaShare * kSigmaShare * view.focal_px * view.focal_px * turned.squaredNorm();
    own.sigma_px = static_cast<float>(std::sqrt(sigma_px2));
  }
}

// One marker hides behind its owner's light, or is not there at all: both have it, neither knows it well.
bool BlobSharer::overlay(const Foreseen& foreseen, ViewHolds& held, std::uint32_t ray, const Group& group,
                         double focal_px) {
  float widest_px = 0.0F;
  for (std::size_t i = 1; i < group.size; ++i) {
    const double apart_px = focal_px * (foreseen.centre(group.markers[i]) - foreseen.centre(group.markers[0])).norm();
    if (apart_px > kCoincide_px) continue;
    Held& other = held.share(group.markers[i], ray);
    other.hidden = true;
    other.sigma_px = static_cast<float>(std::hypot(kLeastSigma_px, 0.5 * apart_px));
    widest_px = std::max(widest_px, other.sigma_px);
  }
  if (!(widest_px > 0.0F)) return false;
  held.share(group.markers[0], ray).sigma_px = widest_px;
  return true;
}

}  // namespace mocap::associate
