#include "associate/predicted/predicted_matcher.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace mocap::associate {
namespace {

constexpr std::uint32_t kNone = AssignedRay::kNone;
// Places of markers in blobs that they share, in one set.
constexpr std::size_t kMaxSharedPlaces = 16 * kMaxMarkers;

}  // namespace

PredictedMatcher::PredictedMatcher(const MatchSettings& settings, std::size_t camera_count, RigError& error)
    : settings_(settings),
      agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
      error_(error),
      max_cos_angle_(std::cos(settings.min_ray_angle_deg * std::numbers::pi / 180.0)),
      gate2_(settings.gate_sigmas * settings.gate_sigmas),
      max_widening_cost_(std::max(0.0, gate2_ - 4.0)),
      assigner_(kMaxMarkers, kMaxBlobs, kMaxGateCandidates),
      merged_resolver_(kMaxMarkers),
      gates_(settings_),
      blob_tracks_(camera_count),
      triangulator_(kMaxMarkers, camera_count),
      camera_count_(camera_count),
      view_count_(camera_count),
      column_of_(kMaxBlobs, kNone),
      ray_assignments_(kMaxMarkers),
      assigned_cost_(kMaxBlobs, 0.0),
      sole_candidates_(kMaxBlobs, 0),
      assignments_(kMaxMarkers, camera_count),
      tracked_markers_(camera_count * kMaxBlobs, BlobTrackOwners::kUnknown),
      has_tracked_markers_(camera_count, 0),
      found_(kMaxMarkers),
      view_counts_(kMaxMarkers, 0),
      is_triangulated_(kMaxMarkers, 0) {
  pairs_.reserve(kMaxGateCandidates);
  ambiguous_.reserve(kMaxGateCandidates);
  contested_.reserve(kMaxGateCandidates);
  row_markers_.reserve(kMaxMarkers);
  column_rays_.reserve(kMaxBlobs);
  shared_quadrics_.reserve(kMaxSharedPlaces);
  broken_tracks_.reserve(kMaxMarkers);
}

void PredictedMatcher::match(const FrameSet& frames, RayTable& rays, const Expected& expected, Matches& into) {
  const std::size_t count = expected.markers.size();
  view_count_ = rays.view_count();
  marker_count_ = count;
  shared_quadrics_.clear();
  assignments_.begin(count, view_count_);
  gates_.set_predictions(expected);
  blob_tracks_.set_predictions(expected);
  broken_tracks_.clear();
  triangulator_.begin(expected);
  // All of a view at once: its numbers are in the cache then.
  for (std::size_t view = 0; view < view_count_; ++view) {
    rays.cast(view);
    if (count == 0) continue;
    look_up_owners(*frames.views[view], rays[view], view);
    const bool shared = assign_view(rays[view], view);
    assignments_.set_view(view, rays[view], ray_assignments_,
                          std::span(tracked_markers_).subspan(view * kMaxBlobs, kMaxBlobs), shared);
    triangulator_.add(rays[view], ray_assignments_);
  }
  if (count == 0) {
    rays.list_unassigned(settings_.agree_sigmas);
    return;
  }
  if (assignments_.any_shared()) remove_duplicate_assignments();
  triangulator_.solve();
  triangulator_.classify_outliers(agreement_);

  for (std::size_t m = 0; m < count; ++m) {
    const bool triangulated = accept_triangulation(m);
    view_counts_[m] = static_cast<std::uint32_t>(triangulated ? triangulator_.ray_count(m)
                                                              : agree(rays, m, expected.markers.data()[m].position));
  }
  for (std::size_t m = count; m-- > 0;) merge_duplicate_track(rays, m);
  // What three or more views tell goes before what two do.
  take_rays_of_sure(rays);
  rays.list_unassigned(settings_.agree_sigmas);
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] < 3 || view_counts_[m] == view_count_) continue;
    search_missing_views(rays, m);
    if (view_counts_[m] == 2) update_use_counts(rays, m, -1);  // a new view set others at odds
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] == 2) resolve_two_view(rays, m, expected.markers.data()[m]);
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] == 1) ++into.seen_once;
    if (view_counts_[m] >= 2) append_match(rays, m, into);
  }
  update_rig_error(rays);
  update_owners(frames, rays);
}

// From some markers a set, each in its turn: the rig changes slowly.
void PredictedMatcher::update_rig_error(const RayTable& rays) {
  constexpr std::size_t kRigErrorMarkersPerSet = 4;
  constexpr std::uint32_t kMinRigErrorViews = 4;
  if (view_count_ != camera_count_) return;
  for (std::size_t i = 0; i < std::min(kRigErrorMarkersPerSet, marker_count_); ++i) {
    const std::size_t m = set_count_++ % marker_count_;
    if (view_counts_[m] < kMinRigErrorViews) continue;
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Assignment& one = assignments_(m, view);
      if (!one.has_ray() || one.is_shared()) continue;
      const ViewRays& view_rays = rays[view];
      error_.learn(view, view_rays.off_px(one.ray, found_[m].point), view_rays.sigma_px[one.ray], view_counts_[m]);
    }
  }
  agreement_.floor_px = settings_.agree_sigmas * error_.px();
}

void PredictedMatcher::update_use_counts(RayTable& rays, std::size_t marker, int change) const {
  for (std::uint64_t views = assignments_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const std::uint16_t ray = assignments_(marker, view).ray;
    if (change > 0) {
      rays[view].increment_use(ray);
    } else {
      rays[view].decrement_use(ray);
    }
  }
}

// The rays of all markers that three or more views agree on: all that were held, but for those given up and those of
// the few other markers.
void PredictedMatcher::take_rays_of_sure(RayTable& rays) const {
  for (std::size_t view = 0; view < view_count_; ++view) rays[view].set_use_counts(assignments_.use_counts(view));
  for (const auto& [view, ray] : assignments_.released()) rays[view].decrement_use(ray);
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (view_counts_[m] < 3) update_use_counts(rays, m, -1);
  }
}

void PredictedMatcher::append_match(const RayTable& rays, std::size_t marker, Matches& into) const {
  if (into.matches.full()) {
    ++into.dropped;
    return;
  }
  Match& match = into.matches.push_back(none_);
  match.expected = static_cast<std::uint32_t>(marker);
  match.by_blob_tracks = tracked_view_count(marker) >= 2;
  const geometry::Refined& found = found_[marker];
  match.triangulation = {found.point, found.covariance_m2, found.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (std::uint64_t views = assignments_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const Assignment& one = assignments_(marker, view);
    BlobRef& seen = match.sightings.push_back({static_cast<std::uint16_t>(view), one.blob, 0.0F, 0.0F, one.sigma_px});
    if (!one.is_shared()) continue;
    const geometry::RayColumns& slope = rays[view].rays;
    const Eigen::Vector2d offset = assignments_.shared_place(one).offset.cast<double>();
    seen.off_x_px = static_cast<float>(slope.ux[one.ray] * offset.x() + slope.uy[one.ray] * offset.y());
    seen.off_y_px = static_cast<float>(slope.vx[one.ray] * offset.x() + slope.vy[one.ray] * offset.y());
  }
}

// A marker that shares all its blobs may be there or not; the others explain the blobs without it. The last born is the
// first to go: two tracks of one marker must not live on each other's blobs.
void PredictedMatcher::remove_duplicate_assignments() {
  for (std::size_t m = marker_count_; m-- > 0;) {
    if (!assignments_.has_exclusive_ray(m)) assignments_.release_all(m);
  }
}

// How unlikely the pair is. How much wider the gate is than its floor enters: of two markers that fit a blob equally
// well the surer one has it, and of two blobs the surer one is had. A gate never shrinks below two standard deviations,
// however unsure the marker is.
double PredictedMatcher::cost_of(const GateCandidate& candidate) const {
  return static_cast<double>(candidate.distance2) +
         std::min(static_cast<double>(std::log(std::max(1.0F, candidate.widening))), max_widening_cost_);
}

// All expected markers of one view at once: the exact assignment by likelihood. Most markers and rays have nobody else,
// or several have one and the same alone: these need no assignment. Says whether any ray is shared.
bool PredictedMatcher::assign_view(const ViewRays& view, std::size_t index) {
  ray_assignments_.begin(marker_count_, view.size());
  if (view.size() == 0) return false;
  const std::span<const GateCandidate> candidates = gates_.candidates(view);
  assign_unambiguous(candidates, index);
  if (!ambiguous_.empty()) assign_ambiguous(candidates, index);
  if (has_tracked_markers_[index] != 0) assign_by_track(view, index);
  return merged_resolver_.resolve(view, gates_.bins(), gates_.predicted(), ray_assignments_);
}

// A marker and a ray that have nobody else. The logarithm in the cost is dear: where even 1 + log <= widening passes,
// it is not asked. Others are several.
void PredictedMatcher::assign_unambiguous(std::span<const GateCandidate> candidates, std::size_t index) {
  const auto limit = static_cast<float>(gate2_) + 1.0F;
  const bool has_tracks = has_tracked_markers_[index] != 0;
  const std::size_t count = candidates.size();
  ambiguous_.clear();
  std::uint32_t before = kNone;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto& [marker, ray, distance2, widening] = candidates[i];
    const std::uint32_t after = i + 1 < count ? candidates[i + 1].marker : kNone;
    const bool many = (marker == before) | (marker == after);
    before = marker;
    if (many | (gates_.gates_containing(ray) != 1) | has_tracks | !(distance2 + widening < limit)) {
      ambiguous_.push_back(i);
      continue;
    }
    ray_assignments_.assign(marker, ray);
  }
}

// All other candidates, marker by marker.
void PredictedMatcher::assign_ambiguous(std::span<const GateCandidate> candidates, std::size_t index) {
  const auto marker = [&](std::size_t i) { return candidates[ambiguous_[i]].marker; };
  const auto last_of = [&](std::size_t first) {
    std::size_t last = first + 1;
    while (last < ambiguous_.size() && marker(last) == marker(first)) ++last;
    return last;
  };
  for (const std::uint32_t i : ambiguous_) sole_candidates_[candidates[i].ray] = 0;
  for (std::size_t first = 0; first < ambiguous_.size();) {
    const std::size_t last = last_of(first);
    if (last - first == 1) ++sole_candidates_[candidates[ambiguous_[first]].ray];
    first = last;
  }
  contested_.clear();
  for (std::size_t first = 0; first < ambiguous_.size();) {
    const std::size_t last = last_of(first);
    assign_marker(candidates, std::span(ambiguous_).subspan(first, last - first), index);
    first = last;
  }
  if (!contested_.empty()) assign_contested(candidates, index);
}

// One marker's. Where one ray is wanted by such only as want nothing else, or one marker wants such only as nobody else
// wants, the cheapest is the best.
void PredictedMatcher::assign_marker(std::span<const GateCandidate> candidates,
                                     std::span<const std::uint32_t> candidate_indices, std::size_t index) {
  bool star = true;
  for (const std::uint32_t i : candidate_indices) {
    const std::uint32_t ray = candidates[i].ray;
    star = star && gates_.gates_containing(ray) == (candidate_indices.size() == 1 ? sole_candidates_[ray] : 1);
  }
  for (const std::uint32_t i : candidate_indices) {
    const GateCandidate& one = candidates[i];
    if (star) {
      assign_if_cheaper(one, cost_of(one) + track_continuity_cost(one.marker, index, one.ray));
    } else {
      contested_.push_back(i);
    }
  }
}

// Holds the cheaper of what a ray or a marker of a star has and what it is offered.
void PredictedMatcher::assign_if_cheaper(const GateCandidate& candidate, double cost) {
  const std::uint32_t previous_ray = ray_assignments_.rays()[candidate.marker];
  const std::uint32_t assigned_marker = ray_assignments_.assigned_marker(candidate.ray);
  if (cost >= gate2_ || (previous_ray != kNone && assigned_cost_[previous_ray] <= cost) ||
      (assigned_marker != kNone && assigned_cost_[candidate.ray] <= cost)) {
    return;
  }
  if (previous_ray != kNone) ray_assignments_.release(candidate.marker);
  if (assigned_marker != kNone) ray_assignments_.release(assigned_marker);
  ray_assignments_.assign(candidate.marker, candidate.ray);
  assigned_cost_[candidate.ray] = cost;
}

void PredictedMatcher::assign_contested(std::span<const GateCandidate> candidates, std::size_t index) {
  pairs_.clear();
  row_markers_.clear();
  column_rays_.clear();
  for (const std::uint32_t i : contested_) {
    const GateCandidate& candidate = candidates[i];
    if (row_markers_.empty() || row_markers_.back() != candidate.marker) row_markers_.push_back(candidate.marker);
    std::uint32_t& column = column_of_[candidate.ray];
    if (column == kNone) {
      column = static_cast<std::uint32_t>(column_rays_.size());
      column_rays_.push_back(candidate.ray);
    }
    pairs_.push_back({static_cast<std::uint32_t>(row_markers_.size() - 1), column,
                      cost_of(candidate) + track_continuity_cost(candidate.marker, index, candidate.ray)});
  }
  const auto columns = assigner_.assign(row_markers_.size(), column_rays_.size(), pairs_, gate2_);
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (columns[row] == geometry::Assigner::kAlone) continue;
    ray_assignments_.assign(row_markers_[row], column_rays_[columns[row]]);
  }
  for (const std::uint32_t ray : column_rays_) column_of_[ray] = kNone;
}

// The place of a marker in a blob that it shares, as a ray; made once a set. Without room the whole blob stands for it.
const geometry::RayQuadric& PredictedMatcher::shared_quadric(const ViewRays& view, AssignedRay& shared_place) {
  if (shared_place.quadric == kNone) {
    if (shared_quadrics_.size() == kMaxSharedPlaces) return view.quadric[shared_place.ray];
    const Eigen::Vector2d at =
        Eigen::Vector2d(view.x(shared_place.ray), view.y(shared_place.ray)) + shared_place.offset.cast<double>();
    shared_place.quadric = static_cast<std::uint32_t>(shared_quadrics_.size());
    shared_quadrics_.push_back(geometry::quadric_of(*view.rows, {{at}, view.rays[shared_place.ray].px_from_ray},
                                                    static_cast<double>(shared_place.sigma_px)));
  }
  return shared_quadrics_[shared_place.quadric];
}

// Whether the two sightings in front look from directions that differ enough.
bool PredictedMatcher::has_parallax(const RayTable& rays, std::size_t marker) const {
  const auto direction = [&](std::size_t i) {
    const std::uint32_t view = sightings_[i].source;
    return rays[view].direction(assignments_(marker, view).ray);
  };
  return std::abs(direction(0).dot(direction(1))) < max_cos_angle_;
}

// Whether a marker's rays, three or more, all agreed at once, or nearly all of many.
bool PredictedMatcher::accept_triangulation(std::size_t marker) {
  is_triangulated_[marker] = 0;
  if (triangulator_.ray_count(marker) < 3) return false;
  if (!triangulator_.rays_agree(marker) && !remove_outliers(marker)) return false;
  is_triangulated_[marker] = 1;
  found_[marker] = triangulator_.triangulation(marker);
  return settings_.in_volume(found_[marker].point.v) &&
         (!assignments_.any_shared() || assignments_.has_exclusive_ray(marker));
}

// Whether the rays of a marker agree but for some that are odd, which are given back.
bool PredictedMatcher::remove_outliers(std::size_t marker) {
  const auto left_out = triangulator_.reject_outliers(marker, agreement_);
  if (!left_out) return false;
  for (std::uint64_t views = *left_out; views != 0; views &= views - 1) {
    assignments_.unassign(marker, static_cast<std::size_t>(std::countr_zero(views)));
  }
  return true;
}

// Appends what the views hold of a marker.
void PredictedMatcher::add_sightings(RayTable& rays, std::size_t marker) {
  for (std::uint64_t views = assignments_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const Assignment& one = assignments_(marker, view);
    rays[view].make_quadric(one.ray);
    auto& sighting = sightings_.push_back(rays[view].sighting(one.ray, static_cast<std::uint32_t>(view)));
    if (!one.is_shared()) continue;
    AssignedRay& shared_place = assignments_.shared_place(one);
    sighting.quadric = &shared_quadric(rays[view], shared_place);
    if (shared_place.quadric != kNone) sighting.sigma_px = static_cast<double>(one.sigma_px);
  }
}

// How many of a marker's views agree; the others are given back.
std::size_t PredictedMatcher::agree(RayTable& rays, std::size_t marker, const WorldPoint& start) {
  sightings_.clear();
  add_sightings(rays, marker);
  if (sightings_.size() < 2) return sightings_.size();
  const auto agreed = geometry::agree(sightings_, start, agreement_);
  if (!agreed || (agreed->kept == 2 && !has_parallax(rays, marker))) return 0;
  if (!settings_.in_volume(agreed->refined.point.v)) return 0;
  found_[marker] = agreed->refined;
  for (std::size_t i = agreed->kept; i < sightings_.size(); ++i) {
    assignments_.unassign(marker, sightings_[i].source);
  }
  return assignments_.has_exclusive_ray(marker) ? agreed->kept : 0;
}

// Where the point is known now, a view that gave no blob or a wrong one is asked again.
void PredictedMatcher::search_missing_views(RayTable& rays, std::size_t marker) {
  const geometry::Refined found = found_[marker];
  const std::size_t released = assignments_.released().size();
  bool added = false;
  rays.project_gaussian(found.point.v, found.covariance_m2, settings_.agree_sigmas, settings_.calibration_px);
  const std::uint64_t all = ~std::uint64_t{0} >> (kMaxCameras - view_count_);
  for (std::uint64_t lacking = all & ~assignments_.views(marker); lacking != 0; lacking &= lacking - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(lacking));
    const auto nearest = rays.nearest_unassigned(view);
    if (!nearest) continue;
    rays[view].increment_use(*nearest);
    assignments_.assign(marker, view, rays[view], *nearest, tracked_marker(view, *nearest) == marker);
    if (is_triangulated_[marker] != 0) triangulator_.add_ray(marker, view, rays[view], *nearest);
    added = true;
  }
  if (!added) return;
  const bool triangulated = is_triangulated_[marker] != 0 && remove_outliers(marker);
  if (triangulated) found_[marker] = triangulator_.triangulation(marker);
  const bool near =
      triangulated && settings_.in_volume(found_[marker].point.v) && assignments_.has_exclusive_ray(marker);
  view_counts_[marker] =
      static_cast<std::uint32_t>(near ? triangulator_.ray_count(marker) : agree(rays, marker, found.point));
  for (const auto& [view, ray] : assignments_.released().subspan(released)) rays[view].decrement_use(ray);
  if (view_counts_[marker] < 2) update_use_counts(rays, marker, -1);
}

}  // namespace mocap::associate
