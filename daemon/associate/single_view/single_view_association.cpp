#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "associate/predicted/predicted_matcher.h"
#include "associate/single_view/association_log_odds.h"

// What is known of a marker by its blobs' 2D tracks, by two views alone, or by one.

namespace mocap::associate {
namespace {

constexpr std::uint32_t kNone = AssignedRay::kNone;
// A 2D track leaps to another marker in one of a thousand images; natural logarithm.
constexpr double kTrackSwapLogOdds = 6.9;
// In every second set or so a marker that one view alone shows, or none, meets a blob of something else within its
// gate: of these, one in so many (33) for each view that might have one is believed, and 2D tracks hold back the most.
constexpr double kPairLogOdds = 3.5;
// A camera that saw a marker sees it in the next set in nine cases of ten.
constexpr double kLostViewLogOdds = 2.3;
// A marker that one camera alone saw comes into another's view in one set of a hundred, and has a 2D track there soon;
// what flashes has none.
constexpr double kNewViewLogOdds = 4.6;
// Where the 2D track of a marker that a camera alone sees broke, the blob near by is the marker's in nine cases of ten;
// hidden markers come into a camera's view once in a second or two.
constexpr double kBrokenTrackLogOdds = 4.0;
// One blob alone only keeps a track in place.
constexpr double kBearingOnlyLogOdds = 4.6;
// And is another's if that is not less likely by this.
constexpr double kRivalLogOdds = 3.0;
// Of a marker that is known less well than hidden neighbours lie apart nobody can say which of them a lone blob is.
constexpr double kAmbiguousPosition_m = 0.02;
// Points of two expected markers that lie farther apart are two markers.
constexpr double kSameMarker_m = 0.02;

BearingOnlyObservation bearing_only_observation(const ViewRays& view, std::size_t ray, std::size_t marker,
                                                std::size_t index) {
  // A patch of the plane at distance 1 is seen under its area over the cube of its distance.
  const double solid_angle_1_px2 = std::pow(1.0 + view.x(ray) * view.x(ray) + view.y(ray) * view.y(ray), -1.5) /
                                   view.rays[ray].px_from_ray.determinant();
  BearingOnlyObservation bearing_only;
  bearing_only.expected = static_cast<std::uint32_t>(marker);
  bearing_only.sighting = {static_cast<std::uint16_t>(index), view.blob[ray], 0.0F, 0.0F,
                           static_cast<float>(view.sigma_px[ray])};
  bearing_only.eye = view.camera->centre();
  bearing_only.direction = view.direction(ray);
  bearing_only.sigma_rad = view.sigma_px[ray] * std::sqrt(solid_angle_1_px2);
  return bearing_only;
}

}  // namespace

// Whose each blob is, by what its 2D track was before.
void PredictedMatcher::look_up_owners(const BlobFrame& frame, const ViewRays& view, std::size_t index) {
  blob_tracks_.begin_image(frame.camera);
  has_tracked_markers_[index] = 0;
  std::uint32_t* const tracked_markers = tracked_markers_.data() + index * kMaxBlobs;
  std::fill_n(tracked_markers, view.size(), BlobTrackOwners::kUnknown);
  if (!view.any_track) return;
  for (std::size_t ray = 0; ray < view.size(); ++ray) {
    tracked_markers[ray] = blob_tracks_.predicted_marker(frame.camera, view.track[ray]);
    if (tracked_markers[ray] != BlobTrackOwners::kUnknown) has_tracked_markers_[index] = 1;
  }
  for (const std::uint32_t marker : blob_tracks_.recent_bearing_only(frame.camera)) {
    if (broken_tracks_.size() == broken_tracks_.capacity() ||
        std::find(tracked_markers, tracked_markers + view.size(), marker) != tracked_markers + view.size())
      continue;
    broken_tracks_.push_back({static_cast<std::uint32_t>(index), marker});
    has_tracked_markers_[index] = 1;
  }
}

// Whether the 2D track of a blob was another marker's; unless that one surely lies elsewhere, and the 2D track leapt.
bool PredictedMatcher::is_other_markers(const RayTable& rays, std::size_t marker, std::size_t view) const {
  const Assignment& assignment = assignments_(marker, view);
  if (!assignment.has_ray()) return false;
  const std::uint16_t ray = assignment.ray;
  const std::uint32_t tracked = tracked_marker(view, ray);
  if (tracked == marker || tracked == BlobTrackOwners::kUnknown) return false;
  if (tracked == BlobTrackOwners::kUnpredicted || view_counts_[tracked] < 3) return true;
  return rays[view].off_px(ray, found_[tracked].point) <
         settings_.agree_sigmas * std::hypot(error_.px(), rays[view].sigma_px[ray]);
}

std::size_t PredictedMatcher::tracked_view_count(std::size_t marker) const {
  std::size_t count = 0;
  for (const Assignment& assignment : assignments_.of(marker)) count += assignment.by_track ? 1 : 0;
  return count;
}

void PredictedMatcher::update_owners(const FrameSet& frames, const RayTable& rays) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const ViewRays& view_rays = rays[view];
    if (!view_rays.any_track) continue;
    for (std::size_t m = 0; m < marker_count_; ++m) {
      const Assignment& one = assignments_(m, view);
      if (view_counts_[m] < 3 || !one.has_ray() || one.is_shared() || one.by_track) continue;
      blob_tracks_.associate(frames.views[view]->camera, view_rays.track[one.ray], static_cast<std::uint32_t>(m));
    }
  }
}

// A marker that two views alone show, where nothing that is known better has their blobs.
void PredictedMatcher::resolve_two_view(RayTable& rays, std::size_t marker, const ExpectedMarker& expected) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Assignment& one = assignments_(marker, view);
    if (!one.has_ray() || one.is_shared() || rays[view].use_count[one.ray] == 0) continue;
    assignments_.unassign(marker, view);
    view_counts_[marker] = 1;
  }
  if (view_counts_[marker] == 2) {
    update_use_counts(rays, marker, +1);
    search_missing_views(rays, marker);
    if (view_counts_[marker] != 2 || is_significant_pair(rays, marker, expected)) return;
    update_use_counts(rays, marker, -1);
  }
  retain_likeliest_view(rays, marker, expected);
}

// Whether both blobs of a marker that two views alone show are hardly anything else's.
bool PredictedMatcher::is_significant_pair(const RayTable& rays, std::size_t marker,
                                           const ExpectedMarker& expected) const {
  const bool was_lone = expected.cameras < 2 && tracked_view_count(marker) == 1;
  // Any of the other views might have had a blob of something else; and where more saw it just now, it lies elsewhere.
  double against = std::log(std::max(1.0, static_cast<double>(view_count_) - 1.0));
  if (expected.cameras > 2) against += kLostViewLogOdds * (expected.cameras - 2.0);
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
  const Eigen::Vector3d ahead = expected.position.v - found_[marker].point.v;
  return pair_log_odds(pair[0], pair[1], ahead, expected.covariance_m2) > kPairLogOdds + against;
}

// Of a pair that is not believed, the view that was the marker's before: by its 2D track, else because it alone has a
// blob where the marker is foreseen. What one camera sees must not be lost because another sees something else nearby.
void PredictedMatcher::retain_likeliest_view(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) {
  std::size_t retained_view = view_count_;
  const std::size_t tracked_views = tracked_view_count(marker);
  if (tracked_views == 0) retained_view = likeliest_view(rays, marker, expected);
  for (std::size_t view = 0; view < view_count_ && tracked_views == 1; ++view) {
    if (assignments_(marker, view).by_track) retained_view = view;
  }
  for (std::size_t view = 0; view < view_count_; ++view) {
    if (view != retained_view) assignments_.unassign(marker, view);
  }
  view_counts_[marker] = retained_view < view_count_ ? 1 : 0;
}

// The only view whose blob is surely no other's; the number of views where none is, or two are.
std::size_t PredictedMatcher::likeliest_view(const RayTable& rays, std::size_t marker,
                                             const ExpectedMarker& expected) const {
  std::size_t likely = view_count_;
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Assignment& one = assignments_(marker, view);
    if (!one.has_ray() || !(single_view_log_odds(rays[view], one.ray, expected, error_.px()) > kBearingOnlyLogOdds))
      continue;
    if (likely < view_count_) return view_count_;
    likely = view;
  }
  return likely;
}

// Whether this view alone saw the marker a moment ago by a 2D track that is gone.
bool PredictedMatcher::is_track_broken(std::size_t view, std::size_t marker) const {
  return std::any_of(broken_tracks_.begin(), broken_tracks_.end(),
                     [&](const BrokenTrack& one) { return one.view == view && one.marker == marker; });
}

// What the 2D track of a blob adds to the cost of its being the marker's.
double PredictedMatcher::track_continuity_cost(std::size_t marker, std::size_t view, std::size_t ray) const {
  if (has_tracked_markers_[view] == 0) return 0.0;
  const std::uint32_t tracked = tracked_marker(view, ray);
  if (tracked == BlobTrackOwners::kUnknown) return is_track_broken(view, marker) ? -2.0 * kBrokenTrackLogOdds : 0.0;
  return tracked == marker ? -2.0 * kTrackSwapLogOdds : 2.0 * kTrackSwapLogOdds;
}

// A marker that leapt out of its gate is known by its 2D track; whether it really did the other views tell.
void PredictedMatcher::assign_by_track(const ViewRays& view, std::size_t index) {
  for (std::uint32_t ray = 0; ray < view.size(); ++ray) {
    const std::uint32_t tracked = tracked_marker(index, ray);
    if (tracked >= marker_count_ || ray_assignments_.assigned_marker(ray) != kNone ||
        ray_assignments_.rays()[tracked] != kNone)
      continue;
    ray_assignments_.assign(tracked, ray);
  }
}

// What else may have made the blob: markers that hardly any view shows, by how likely each is.
PredictedMatcher::RivalDistribution PredictedMatcher::rival_distribution(const ViewRays& view, std::size_t ray,
                                                                         std::size_t marker, double odds,
                                                                         const Expected& expected) const {
  RivalDistribution distribution;
  double total = 1.0;
  double square_m2 = 0.0;
  for (std::size_t other = 0; other < marker_count_; ++other) {
    if (other == marker || view_counts_[other] > 1) continue;
    const ExpectedMarker& one = expected.markers.data()[other];
    const double ahead = single_view_log_odds(view, ray, one, error_.px()) - odds;
    if (!std::isfinite(ahead)) continue;
    if (ahead > -kRivalLogOdds) distribution.is_empty = false;
    const Eigen::Vector3d apart = one.position.v - expected.markers.data()[marker].position.v;
    const double share = std::exp(std::min(0.0, ahead));
    total += share;
    distribution.off_m += share * apart;
    square_m2 += share * apart.squaredNorm();
  }
  distribution.off_m /= total;
  distribution.spread_m = std::sqrt(std::max(0.0, square_m2 / total - distribution.off_m.squaredNorm()) / 3.0);
  return distribution;
}

// Whichever it is that is seen: the marker lies beside the ray by what those that it may be lie apart.
void PredictedMatcher::shift_bearing(const RivalDistribution& distribution, const ExpectedMarker& expected,
                                     BearingOnlyObservation& bearing_only) {
  const double depth_m = (expected.position.v - bearing_only.eye.v).dot(bearing_only.direction);
  if (!(depth_m > 0.0)) return;
  bearing_only.direction = (depth_m * bearing_only.direction - distribution.off_m).normalized();
  bearing_only.sigma_rad = std::hypot(bearing_only.sigma_rad, distribution.spread_m / depth_m);
}

void PredictedMatcher::append_bearing_only(const FrameSet& frames, const RayTable& rays, const Expected& expected,
                                           Matches& into) {
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (view_counts_[m] != 1) continue;
    const ExpectedMarker& marker = expected.markers.data()[m];
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
        distribution = rival_distribution(rays[view], ray, m, odds, expected);
      const bool unknown = marker.covariance_m2.trace() > 3.0 * kAmbiguousPosition_m * kAmbiguousPosition_m;
      if (!distribution.is_empty && unknown) shift_bearing(distribution, marker, bearing_only);
      if (!into.bearing_only.try_push_back(bearing_only)) return;
      if (!distribution.is_empty) continue;
      const CameraId camera = frames.views[view]->camera;
      blob_tracks_.note_bearing_only(camera, bearing_only.expected);
      blob_tracks_.associate(camera, rays[view].track[ray], bearing_only.expected);
    }
  }
}

// Two tracks of one marker would share its views for ever, each with half of them: where all of both agree on one
// point, the older has them.
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
