#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "associate/predicted/predicted_matcher.h"
#include "associate/single_view/association_log_odds.h"

// The part of PredictedMatcher for markers with few views: identity of 2D tracks, matches of two views, bearing-only
// observations.

namespace mocap::associate {
namespace {

constexpr std::uint32_t kNone = AssignedRay::kNone;
// Natural log odds that a 2D track stays on its marker: it jumps to another marker in 1 of 1000 images. Chosen by hand;
// not yet measured.
constexpr double kTrackSwapLogOdds = 6.9;
// Log odds that a match of two views needs, for each view that may have contributed a false blob: exp(3.5) = 33. About
// every second set a marker with one view or none has a false second blob in its gate. Chosen by hand; not yet
// measured.
constexpr double kPairLogOdds = 3.5;
// Log odds that a camera that saw a marker sees it in the next set: 9 of 10. Chosen by hand; not yet measured.
constexpr double kLostViewLogOdds = 2.3;
// Additional log odds for a second view without a 2D track: a bearing-only marker enters another view in 1 of 100 sets,
// and soon has a 2D track there; a flash has none. See decisions/0014.
constexpr double kNewViewLogOdds = 4.6;
// Log odds that the next blob near a bearing-only marker whose 2D track ended is the marker's: against other hidden
// markers, which enter a view once in a second or two. See decisions/0010. Chosen by hand; not yet measured.
constexpr double kBrokenTrackLogOdds = 4.0;
// Log odds against clutter that a bearing-only observation needs: 100 to 1. Chosen by hand; not yet measured.
constexpr double kBearingOnlyLogOdds = 4.6;
// Another marker makes the observation ambiguous unless it is less likely by these log odds (20 to 1). Chosen by hand;
// not yet measured.
constexpr double kRivalLogOdds = 3.0;
// A prediction with a larger standard deviation cannot be distinguished from hidden neighbours. Chosen by hand; not
// yet measured.
constexpr double kAmbiguousPosition_m = 0.02;
// Two tracks whose points lie farther apart are different markers. Chosen by hand; not yet measured.
constexpr double kSameMarker_m = 0.02;

BearingOnlyObservation bearing_only_observation(const ViewRays& view, std::size_t ray, std::size_t marker,
                                                std::size_t index) {
  // The solid angle of a patch of the plane at distance 1 is its area over the cube of its distance from the centre.
  const double solid_angle_1_px2 = std::pow(1.0 + view.x(ray) * view.x(ray) + view.y(ray) * view.y(ray), -1.5) /
                                   view.rays[ray].px_from_ray.determinant();
  BearingOnlyObservation bearing_only;
  bearing_only.prediction = static_cast<std::uint32_t>(marker);
  bearing_only.sighting = {static_cast<std::uint16_t>(index), view.blob[ray], 0.0F, 0.0F,
                           static_cast<float>(view.sigma_px[ray])};
  bearing_only.eye = view.camera->centre();
  bearing_only.direction = view.direction(ray);
  bearing_only.sigma_rad = view.sigma_px[ray] * std::sqrt(solid_angle_1_px2);
  return bearing_only;
}

}  // namespace

// Looks up the predicted marker of each ray of a view by its 2D track, and the broken 2D tracks: those of markers that
// only this camera saw recently and that no blob of this view continues.
void PredictedMatcher::look_up_identities(const Predictions& predicted, const ViewRays& view, std::size_t index) {
  has_tracked_markers_[index] = 0;
  std::uint32_t* const tracked_markers = tracked_markers_.data() + index * kMaxBlobs;
  std::fill_n(tracked_markers, view.size(), BlobIdentities::kUnknown);
  if (!view.any_track || index >= predicted.views.size()) return;
  const BlobIdentities& identities = predicted.views[index];
  for (std::size_t ray = 0; ray < view.size(); ++ray) {
    tracked_markers[ray] = identities.marker_of_blob[view.blob[ray]];
    if (tracked_markers[ray] != BlobIdentities::kUnknown) has_tracked_markers_[index] = 1;
  }
  for (const std::uint32_t marker : identities.recent_bearing_only) {
    if (broken_tracks_.size() == broken_tracks_.capacity() ||
        std::find(tracked_markers, tracked_markers + view.size(), marker) != tracked_markers + view.size())
      continue;
    broken_tracks_.push_back({static_cast<std::uint32_t>(index), marker});
    has_tracked_markers_[index] = 1;
  }
}

// Whether the 2D track of the blob is established as another marker's. Returns false if three or more views find the
// other marker at another position: then the 2D track jumped.
bool PredictedMatcher::is_other_markers(const RayTable& rays, std::size_t marker, std::size_t view) const {
  const Assignment& assignment = assignments_(marker, view);
  if (!assignment.has_ray()) return false;
  const std::uint16_t ray = assignment.ray;
  const std::uint32_t tracked = tracked_marker(view, ray);
  if (tracked == marker || tracked == BlobIdentities::kUnknown) return false;
  if (tracked == BlobIdentities::kUnpredicted || view_counts_[tracked] < 3) return true;
  return rays[view].off_px(ray, found_[tracked].point) <
         settings_.agree_sigmas * std::hypot(error_.px(), rays[view].sigma_px[ray]);
}

std::size_t PredictedMatcher::tracked_view_count(std::size_t marker) const {
  std::size_t count = 0;
  for (const Assignment& assignment : assignments_.of(marker)) count += assignment.by_track ? 1 : 0;
  return count;
}

// Resolves a marker with two views: releases blobs that markers with more views use, searches more views, and keeps the
// pair only if it is significant.
void PredictedMatcher::resolve_two_view(RayTable& rays, std::size_t marker, const PredictedMarker& predicted) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Assignment& one = assignments_(marker, view);
    if (!one.has_ray() || one.is_shared() || rays[view].use_count[one.ray] == 0) continue;
    assignments_.unassign(marker, view);
    view_counts_[marker] = 1;
  }
  if (view_counts_[marker] == 2) {
    update_use_counts(rays, marker, +1);
    search_missing_views(rays, marker);
    if (view_counts_[marker] != 2 || is_significant_pair(rays, marker, predicted)) return;
    update_use_counts(rays, marker, -1);
  }
  retain_likeliest_view(rays, marker, predicted);
}

// Whether the two blobs of a marker are significantly more likely the marker's than clutter.
bool PredictedMatcher::is_significant_pair(const RayTable& rays, std::size_t marker,
                                           const PredictedMarker& predicted) const {
  const bool was_lone = predicted.cameras < 2 && tracked_view_count(marker) == 1;
  // Multiple comparisons: any other view might have had a false blob. If more cameras saw the marker in the last set,
  // most of these cameras should see the marker now.
  double against = std::log(std::max(1.0, static_cast<double>(view_count_) - 1.0));
  if (predicted.cameras > 2) against += kLostViewLogOdds * (predicted.cameras - 2.0);
  BoundedVector<ViewObservation, 2> pair;
  for (std::size_t view = 0; view < view_count_; ++view) {
    const AssignedRay assigned = assignments_.assigned(marker, view);
    if (assigned.ray == kNone) continue;
    if (assigned.hidden || is_other_markers(rays, marker, view)) return false;
    const bool perhaps_flashed =
        !assignments_(marker, view).by_track && !rays[view].track[assigned.ray].names_something();
    if (was_lone && perhaps_flashed) against += kNewViewLogOdds;
    ViewObservation& one = pair.push_back(view_observation(rays[view], assigned, found_[marker].point, error_.px()));
    if (assignments_(marker, view).by_track) one.clutter_density_1_px2 *= std::exp(-kTrackSwapLogOdds);
  }
  const auto off2 = [](const ViewObservation& view) {
    return view.off_px.squaredNorm() / (view.sigma_px * view.sigma_px);
  };
  if (off2(pair[0]) + off2(pair[1]) > settings_.agree_sigmas * settings_.agree_sigmas) return false;
  const Eigen::Vector3d ahead = predicted.position.v - found_[marker].point.v;
  return pair_log_odds(pair[0], pair[1], ahead, predicted.covariance_m2) > kPairLogOdds + against;
}

// Retains one view of a pair that is not significant: the view whose 2D track is the marker's, else the only view whose
// blob is significantly the marker's. Clutter in another camera must not remove a valid bearing.
void PredictedMatcher::retain_likeliest_view(const RayTable& rays, std::size_t marker,
                                             const PredictedMarker& predicted) {
  std::size_t retained_view = view_count_;
  const std::size_t tracked_views = tracked_view_count(marker);
  if (tracked_views == 0) retained_view = likeliest_view(rays, marker, predicted);
  for (std::size_t view = 0; view < view_count_ && tracked_views == 1; ++view) {
    if (assignments_(marker, view).by_track) retained_view = view;
  }
  for (std::size_t view = 0; view < view_count_; ++view) {
    if (view != retained_view) assignments_.unassign(marker, view);
  }
  view_counts_[marker] = retained_view < view_count_ ? 1 : 0;
}

// The only view whose blob is significantly the marker's; the number of views if there is none or more than one.
std::size_t PredictedMatcher::likeliest_view(const RayTable& rays, std::size_t marker,
                                             const PredictedMarker& predicted) const {
  std::size_t likely = view_count_;
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Assignment& one = assignments_(marker, view);
    if (!one.has_ray() || !(single_view_log_odds(rays[view], one.ray, predicted, error_.px()) > kBearingOnlyLogOdds))
      continue;
    if (likely < view_count_) return view_count_;
    likely = view;
  }
  return likely;
}

// Whether this view alone saw the marker recently, by a 2D track that has ended.
bool PredictedMatcher::is_track_broken(std::size_t view, std::size_t marker) const {
  return std::any_of(broken_tracks_.begin(), broken_tracks_.end(),
                     [&](const BrokenTrack& one) { return one.view == view && one.marker == marker; });
}

// The cost that the identity of a blob's 2D track adds to its assignment to a marker (-2 log odds).
double PredictedMatcher::track_continuity_cost(std::size_t marker, std::size_t view, std::size_t ray) const {
  if (has_tracked_markers_[view] == 0) return 0.0;
  const std::uint32_t tracked = tracked_marker(view, ray);
  if (tracked == BlobIdentities::kUnknown) return is_track_broken(view, marker) ? -2.0 * kBrokenTrackLogOdds : 0.0;
  return tracked == marker ? -2.0 * kTrackSwapLogOdds : 2.0 * kTrackSwapLogOdds;
}

// Assigns a ray outside the gate to the marker of its 2D track. The agreement of the views then decides.
void PredictedMatcher::assign_by_track(const ViewRays& view, std::size_t index) {
  for (std::uint32_t ray = 0; ray < view.size(); ++ray) {
    const std::uint32_t tracked = tracked_marker(index, ray);
    if (tracked >= marker_count_ || ray_assignments_.assigned_marker(ray) != kNone ||
        ray_assignments_.rays()[tracked] != kNone)
      continue;
    ray_assignments_.assign(tracked, ray);
  }
}

// The distribution of other markers that may be the source of a blob: markers with at most one view, by their
// likelihood.
PredictedMatcher::RivalDistribution PredictedMatcher::rival_distribution(const ViewRays& view, std::size_t ray,
                                                                         std::size_t marker, double odds,
                                                                         const Predictions& predicted) const {
  RivalDistribution distribution;
  double total = 1.0;
  double square_m2 = 0.0;
  for (std::size_t other = 0; other < marker_count_; ++other) {
    if (other == marker || view_counts_[other] > 1) continue;
    const PredictedMarker& one = predicted.markers.data()[other];
    const double ahead = single_view_log_odds(view, ray, one, error_.px()) - odds;
    if (!std::isfinite(ahead)) continue;
    if (ahead > -kRivalLogOdds) distribution.is_empty = false;
    const Eigen::Vector3d apart = one.position.v - predicted.markers.data()[marker].position.v;
    const double share = std::exp(std::min(0.0, ahead));
    total += share;
    distribution.off_m += share * apart;
    square_m2 += share * apart.squaredNorm();
  }
  distribution.off_m /= total;
  distribution.spread_m = std::sqrt(std::max(0.0, square_m2 / total - distribution.off_m.squaredNorm()) / 3.0);
  return distribution;
}

// Shifts the bearing so that it constrains the mean of the possible markers, and adds their spread to its uncertainty.
void PredictedMatcher::shift_bearing(const RivalDistribution& distribution, const PredictedMarker& predicted,
                                     BearingOnlyObservation& bearing_only) {
  const double depth_m = (predicted.position.v - bearing_only.eye.v).dot(bearing_only.direction);
  if (!(depth_m > 0.0)) return;
  bearing_only.direction = (depth_m * bearing_only.direction - distribution.off_m).normalized();
  bearing_only.sigma_rad = std::hypot(bearing_only.sigma_rad, distribution.spread_m / depth_m);
}

void PredictedMatcher::append_bearing_only(const RayTable& rays, const Predictions& predicted, Matches& into) {
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (view_counts_[m] != 1) continue;
    const PredictedMarker& marker = predicted.markers.data()[m];
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Assignment& one = assignments_(m, view);
      const std::uint16_t ray = one.ray;
      if (!one.has_ray() || rays[view].use_count[ray] != 0 || !assignments_.is_exclusive(view, ray) ||
          is_other_markers(rays, m, view)) {
        continue;
      }
      const double odds = single_view_log_odds(rays[view], ray, marker, error_.px());
      if (!one.by_track && !(odds > kBearingOnlyLogOdds)) continue;
      BearingOnlyObservation bearing_only = bearing_only_observation(rays[view], ray, m, view);
      RivalDistribution distribution;
      if (!one.by_track && !is_track_broken(view, m))
        distribution = rival_distribution(rays[view], ray, m, odds, predicted);
      const bool unknown = marker.covariance_m2.trace() > 3.0 * kAmbiguousPosition_m * kAmbiguousPosition_m;
      if (!distribution.is_empty && unknown) shift_bearing(distribution, marker, bearing_only);
      bearing_only.is_ambiguous = !distribution.is_empty;
      if (!into.bearing_only.try_push_back(bearing_only)) return;
    }
  }
}

// Merges two tracks of one marker, which would otherwise share its views permanently: if all views of both agree on one
// point, the older track gets them.
void PredictedMatcher::merge_duplicate_track(RayTable& rays, std::size_t marker) {
  if (view_counts_[marker] < 2 || 2 * view_counts_[marker] > view_count_) return;
  for (std::size_t older = 0; older < marker_count_; ++older) {
    if (older == marker || view_counts_[older] < 2 || view_counts_[older] + view_counts_[marker] > view_count_)
      continue;
    if ((found_[older].point.v - found_[marker].point.v).squaredNorm() > kSameMarker_m * kSameMarker_m) continue;
    bool apart = false;
    for (std::size_t view = 0; view < view_count_; ++view) {
      apart = apart || (assignments_(older, view).has_ray() && assignments_(marker, view).has_ray());
    }
    if (apart) continue;
    sightings_.clear();
    add_sightings(rays, older);
    add_sightings(rays, marker);
    const auto agreed = geometry::agree(sightings_, found_[older].point, agreement_);
    if (!agreed || agreed->kept != sightings_.size()) continue;
    const std::size_t keeper = std::min(older, marker), other = std::max(older, marker);
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Assignment& given = assignments_(other, view);
      assignments_.transfer(keeper, other, view, given.has_ray() && tracked_marker(view, given.ray) == keeper);
    }
    found_[keeper] = agreed->refined;
    view_counts_[keeper] = static_cast<std::uint32_t>(agreed->kept);
    view_counts_[other] = 0;
    is_triangulated_[keeper] = is_triangulated_[other] = 0;
    return;
  }
}

}  // namespace mocap::associate
