#include "associate/predicted/predicted_matcher.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace mocap::associate {
namespace {

constexpr std::uint32_t kNone = AssignedRay::kNone;
// Bound for one set: positions of markers in shared blobs.
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
      triangulator_(kMaxMarkers, camera_count),
      camera_count_(camera_count),
      view_count_(camera_count),
      column_of_(kMaxBlobs, kNone),
      ray_assignments_(kMaxMarkers),
      assigned_cost_(kMaxBlobs, 0.0),
      sole_candidates_(kMaxBlobs, 0),
      assignments_(kMaxMarkers, camera_count),
      tracked_markers_(camera_count * kMaxBlobs, BlobIdentities::kUnknown),
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

void PredictedMatcher::match(RayTable& rays, const Predictions& predicted, Matches& into) {
  const std::size_t count = predicted.markers.size();
  view_count_ = rays.view_count();
  marker_count_ = count;
  shared_quadrics_.clear();
  assignments_.begin(count, view_count_);
  gates_.set_predictions(predicted);
  broken_tracks_.clear();
  triangulator_.begin(predicted);
  // All steps of one view run together, so that the data of the view stay in the cache.
  for (std::size_t view = 0; view < view_count_; ++view) {
    rays.cast(view);
    if (count == 0) continue;
    look_up_identities(predicted, rays[view], view);
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
                                                              : agree(rays, m, predicted.markers.data()[m].position));
  }
  for (std::size_t m = count; m-- > 0;) merge_duplicate_track(rays, m);
  // Markers with three or more views get their rays before markers with two.
  use_rays_of_three_views(rays);
  rays.list_unassigned(settings_.agree_sigmas);
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] < 3 || view_counts_[m] == view_count_) continue;
    search_missing_views(rays, m);
    if (view_counts_[m] == 2) update_use_counts(rays, m, -1);  // the new view disagreed and others were removed
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] == 2) resolve_two_view(rays, m, predicted.markers.data()[m]);
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (view_counts_[m] == 1) ++into.seen_once;
    if (view_counts_[m] >= 2) append_match(rays, m, into);
  }
  update_rig_error(rays);
}

// Learns the rig error from a few markers a set, in turn: the rig error changes slowly.
void PredictedMatcher::update_rig_error(const RayTable& rays) {
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

// Sets the use counts of all rays to the number of markers with three or more views that have the ray: all assigned
// rays, less the released ones and those of the other markers.
void PredictedMatcher::use_rays_of_three_views(RayTable& rays) const {
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
  match.prediction = static_cast<std::uint32_t>(marker);
  match.by_blob_tracks = tracked_view_count(marker) >= 2;
  const geometry::Refined& found = found_[marker];
  match.triangulation = {found.point, found.covariance_m2, found.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (std::uint64_t views = assignments_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const Assignment& one = assignments_(marker, view);
    BlobRef& seen = match.sightings.push_back({static_cast<std::uint16_t>(view), one.blob, 0.0F, 0.0F, one.sigma_px});
    if (!one.is_shared()) continue;
    seen.is_shared = true;
    const geometry::RayColumns& slope = rays[view].rays;
    const Eigen::Vector2d offset = assignments_.shared_place(one).offset.cast<double>();
    seen.off_x_px = static_cast<float>(slope.ux[one.ray] * offset.x() + slope.uy[one.ray] * offset.y());
    seen.off_y_px = static_cast<float>(slope.vx[one.ray] * offset.x() + slope.vy[one.ray] * offset.y());
  }
}

// Releases all rays of a marker that shares all its blobs with other markers: the other markers explain these blobs.
// The youngest track is tested first, so that two tracks of one marker do not sustain each other.
void PredictedMatcher::remove_duplicate_assignments() {
  for (std::size_t m = marker_count_; m-- > 0;) {
    if (!assignments_.has_exclusive_ray(m)) assignments_.release_all(m);
  }
}

// The cost of a candidate: -2 log likelihood up to a constant, d^2 + log det S. If two markers are at the same
// normalised distance, the more certain marker gets the blob. The log term is limited so that the gate of an uncertain
// marker never shrinks below two standard deviations.
double PredictedMatcher::cost_of(const GateCandidate& candidate) const {
  return static_cast<double>(candidate.distance2) +
         std::min(static_cast<double>(std::log(std::max(1.0F, candidate.widening))), max_widening_cost_);
}

// Assigns the rays of one view to all predicted markers with the least total cost. Most markers and rays have only each
// other, which needs no assignment solver. Returns whether any ray is shared.
bool PredictedMatcher::assign_view(const ViewRays& view, std::size_t index) {
  ray_assignments_.begin(marker_count_, view.size());
  if (view.size() == 0) return false;
  const std::span<const GateCandidate> candidates = gates_.candidates(view);
  assign_unambiguous(candidates, index);
  if (!ambiguous_.empty()) assign_ambiguous(candidates, index);
  if (has_tracked_markers_[index] != 0) assign_by_track(view, index);
  return merged_resolver_.resolve(view, gates_.bins(), gates_.predicted(), ray_assignments_);
}

// Assigns each marker and ray that are each other's only candidate; collects all other candidates in ambiguous_. The
// logarithm of the cost is slow: since 1 + log(w) <= w, the test without the logarithm is sufficient.
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

// Assigns the ambiguous candidates, marker by marker.
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

// Assigns the candidates of one marker if they form a star: several markers with one ray as their only candidate, or
// one marker with several rays that have no other candidate. In a star the cheapest candidate is optimal. All other
// candidates go to the assignment solver.
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

// Assigns a candidate of a star if it is cheaper than the assignment so far.
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
    if (columns[row] == geometry::Assigner::kUnassigned) continue;
    ray_assignments_.assign(row_markers_[row], column_rays_[columns[row]]);
  }
  for (const std::uint32_t ray : column_rays_) column_of_[ray] = kNone;
}

// The quadric of a marker's position in a shared blob, made once a set. Beyond the bound the quadric of the blob is
// used.
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

// Whether the rays of the first two sightings are far enough from parallel.
bool PredictedMatcher::has_parallax(const RayTable& rays, std::size_t marker) const {
  const auto direction = [&](std::size_t i) {
    const std::uint32_t view = sightings_[i].source;
    return rays[view].direction(assignments_(marker, view).ray);
  };
  return std::abs(direction(0).dot(direction(1))) < max_cos_angle_;
}

// Whether the batch triangulation of a marker is valid: three or more rays agree, after outliers were removed.
bool PredictedMatcher::accept_triangulation(std::size_t marker) {
  is_triangulated_[marker] = 0;
  if (triangulator_.ray_count(marker) < 3) return false;
  if (!triangulator_.rays_agree(marker) && !remove_outliers(marker)) return false;
  is_triangulated_[marker] = 1;
  found_[marker] = triangulator_.triangulation(marker);
  return settings_.in_volume(found_[marker].point.v) &&
         (!assignments_.any_shared() || assignments_.has_exclusive_ray(marker));
}

// Whether the rays of a marker agree after outliers were removed and released.
bool PredictedMatcher::remove_outliers(std::size_t marker) {
  const auto left_out = triangulator_.reject_outliers(marker, agreement_);
  if (!left_out) return false;
  for (std::uint64_t views = *left_out; views != 0; views &= views - 1) {
    assignments_.unassign(marker, static_cast<std::size_t>(std::countr_zero(views)));
  }
  return true;
}

// Appends the sightings of a marker in all views.
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

// Returns the number of views of a marker that agree; releases the others.
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

// Searches a view without a ray of the marker again, now that the point is known.
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
