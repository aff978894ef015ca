#include "stages/match_expected.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::stages {
namespace {

constexpr std::uint32_t kNone = Held::kNone;
// Places of markers in blobs that they share, in one set.
constexpr std::size_t kMaxShared = 16 * kMaxMarkers;

}  // namespace

ExpectedMatcher::ExpectedMatcher(const MatchSettings& settings, std::size_t camera_count, RigError& error)
    : settings_(settings),
      agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
      error_(error),
      max_cos_angle_(std::cos(settings.min_ray_angle_deg * std::numbers::pi / 180.0)),
      assigner_(kMaxMarkers, kMaxBlobs, kMaxGateCandidates),
      sharer_(kMaxMarkers),
      gates_(settings_),
      owners_(camera_count),
      meetings_(kMaxMarkers, camera_count),
      camera_count_(camera_count),
      view_count_(camera_count),
      column_of_(kMaxBlobs, kNone),
      held_(kMaxMarkers * camera_count),
      owner_(camera_count * kMaxBlobs, BlobOwners::kNobody),
      is_held_(kMaxBlobs, 0),
      holders_(camera_count * kMaxBlobs, 0),
      found_(kMaxMarkers),
      views_of_(kMaxMarkers, 0) {
  pairs_.reserve(kMaxGateCandidates);
  contested_.reserve(kMaxGateCandidates);
  row_markers_.reserve(kMaxMarkers);
  column_rays_.reserve(kMaxBlobs);
  shared_quadrics_.reserve(kMaxShared);
}

void ExpectedMatcher::match(const FrameSet& frames, RayTable& rays, const Expected& expected, Matches& into) {
  const std::size_t count = expected.markers.size();
  view_count_ = rays.view_count();
  marker_count_ = count;
  any_shared_ = false;
  shared_quadrics_.clear();
  std::fill_n(held_.begin(), count * view_count_, Held{});
  gates_.expect(expected);
  owners_.expect(expected);
  meetings_.begin(expected);
  // All of a view at once: its numbers are in the cache then.
  for (std::size_t view = 0; view < view_count_; ++view) {
    rays.cast(view);
    if (count == 0) continue;
    find_owners(*frames.views[view], rays[view], view);
    assign_view(rays[view], view);
    meetings_.add(rays[view], held_of(view));
  }
  if (count == 0) return;
  if (any_shared_) forsake_doubles(rays);
  meetings_.solve();
  meetings_.judge(agreement_);

  for (std::size_t m = 0; m < count; ++m) {
    const bool met = take_meeting(m);
    views_of_[m] =
        static_cast<std::uint32_t>(met ? meetings_.rays_of(m) : agree(rays, m, expected.markers.data()[m].position));
  }
  for (std::size_t m = count; m-- > 0;) join_older(rays, m);
  // What three or more views tell goes before what two do.
  for (std::size_t m = 0; m < count; ++m) {
    if (views_of_[m] >= 3) mark(rays, m, +1);
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (views_of_[m] < 3 || views_of_[m] == view_count_) continue;
    recover(rays, m);
    if (views_of_[m] == 2) mark(rays, m, -1);  // a new view set others at odds
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (views_of_[m] == 2) settle_pair(rays, m, expected.markers.data()[m]);
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (views_of_[m] == 1) ++into.seen_once;
    if (views_of_[m] >= 2) give(rays, m, into);
  }
  learn_error(rays);
  learn_owners(frames, rays);
}

// From some markers a set, each in its turn: the rig changes slowly.
void ExpectedMatcher::learn_error(const RayTable& rays) {
  constexpr std::size_t kMarkersASet = 4;
  constexpr std::uint32_t kMany = 4;
  if (view_count_ != camera_count_) return;
  for (std::size_t i = 0; i < std::min(kMarkersASet, marker_count_); ++i) {
    const std::size_t m = turn_++ % marker_count_;
    if (views_of_[m] < kMany) continue;
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Held& one = held(m, view);
      if (one.ray == kNone || one.sigma_px > 0.0F) continue;
      const ViewRays& own = rays[view];
      error_.learn(view, own.off_px(one.ray, found_[m].point), own.sigma_px[one.ray], views_of_[m]);
    }
  }
  agreement_.floor_px = settings_.agree_sigmas * error_.px();
}

void ExpectedMatcher::mark(RayTable& rays, std::size_t marker, int change) const {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t ray = held(marker, view).ray;
    if (ray == kNone) continue;
    if (change > 0) {
      rays[view].take(ray);
    } else {
      rays[view].give_back(ray);
    }
  }
}

void ExpectedMatcher::give(const RayTable& rays, std::size_t marker, Matches& into) const {
  if (into.matches.full()) {
    ++into.dropped;
    return;
  }
  Match& match = into.matches.push_back({});
  match.expected = static_cast<std::uint32_t>(marker);
  match.by_blob_tracks = own_views(marker) >= 2;
  const geometry::Refined& found = found_[marker];
  match.start = found.point;
  match.meeting = {found.point, found.covariance_m2, found.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Held& one = held(marker, view);
    if (one.ray == kNone) continue;
    BlobRef& seen = match.sightings.push_back({});
    seen.view = static_cast<std::uint16_t>(view);
    seen.blob = rays[view].blob[one.ray];
    seen.sigma_px = static_cast<float>(rays[view].sigma_px[one.ray]);
    if (one.sigma_px > 0.0F) {
      const geometry::RayColumns& slope = rays[view].rays;
      const Eigen::Vector2d off = one.off.cast<double>();
      seen.off_x_px = static_cast<float>(slope.ux[one.ray] * off.x() + slope.uy[one.ray] * off.y());
      seen.off_y_px = static_cast<float>(slope.vx[one.ray] * off.x() + slope.vy[one.ray] * off.y());
      seen.sigma_px = one.sigma_px;
    }
  }
}

// Whether a view shows this marker and no other.
bool ExpectedMatcher::has_own_ray(std::size_t marker) const {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t ray = held(marker, view).ray;
    if (ray != kNone && is_alone(view, ray)) return true;
  }
  return false;
}

// A marker that shares all its blobs may be there or not; the others explain the blobs without it. The last born is the
// first to go: two tracks of one marker must not live on each other's blobs.
void ExpectedMatcher::forsake_doubles(const RayTable& rays) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    std::fill_n(holders_.begin() + static_cast<std::ptrdiff_t>(view * kMaxBlobs), rays[view].size(), std::uint8_t{0});
    for (std::size_t m = 0; m < marker_count_; ++m) {
      const std::uint32_t ray = held(m, view).ray;
      if (ray != kNone) ++holders(view, ray);
    }
  }
  for (std::size_t m = marker_count_; m-- > 0;) {
    if (has_own_ray(m)) continue;
    for (std::size_t view = 0; view < view_count_; ++view) {
      Held& one = held(m, view);
      if (one.ray != kNone) --holders(view, one.ray);
      one = {};
    }
  }
}

// How unlikely the pair is. How much wider the gate is than its floor enters: of two markers that fit a blob equally
// well the surer one has it, and of two blobs the surer one is had. A gate never shrinks below two standard deviations,
// however unsure the marker is.
double ExpectedMatcher::cost_of(const GateCandidate& candidate) const {
  const double widest = std::max(0.0, settings_.gate_sigmas * settings_.gate_sigmas - 4.0);
  return static_cast<double>(candidate.distance2) +
         std::min(std::log(std::max(1.0, static_cast<double>(candidate.widening))), widest);
}

// All expected markers of one view at once: the exact assignment by likelihood. A marker and a ray that have nobody
// else need no assignment.
void ExpectedMatcher::assign_view(const ViewRays& view, std::size_t index) {
  const double gate2 = settings_.gate_sigmas * settings_.gate_sigmas;
  if (view.size() == 0) return;
  const std::span<const GateCandidate> candidates = gates_.candidates(view);
  contested_.clear();
  std::fill_n(is_held_.begin(), view.size(), std::uint8_t{0});
  for (std::uint32_t i = 0; i < candidates.size(); ++i) {
    const auto& [marker, ray, distance2, widening] = candidates[i];
    const double known = odds_of_owner(marker, index, ray);
    const bool marker_alone = (i == 0 || candidates[i - 1].marker != marker) &&
                              (i + 1 == candidates.size() || candidates[i + 1].marker != marker);
    if (!marker_alone || gates_.wanted_by(ray) != 1) {
      contested_.push_back(i);
      continue;
    }
    // The logarithm is dear: where even 1 + log <= widening passes, it is not asked.
    if (static_cast<double>(distance2 + widening) - 1.0 + known < gate2 || cost_of(candidates[i]) + known < gate2) {
      held(marker, index).ray = ray;
      is_held_[ray] = 1;
    }
  }
  if (!contested_.empty()) assign_contested(candidates, index, gate2);
  claim_own(view, index);
  any_shared_ = sharer_.share(view, gates_.foreseen(), held_of(index)) || any_shared_;
}

void ExpectedMatcher::assign_contested(std::span<const GateCandidate> candidates, std::size_t index, double gate2) {
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
                      cost_of(candidate) + odds_of_owner(candidate.marker, index, candidate.ray)});
  }
  const auto columns = assigner_.assign(row_markers_.size(), column_rays_.size(), pairs_, gate2);
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (columns[row] == geometry::Assigner::kAlone) continue;
    held(row_markers_[row], index).ray = column_rays_[columns[row]];
    is_held_[column_rays_[columns[row]]] = 1;
  }
  for (const std::uint32_t ray : column_rays_) column_of_[ray] = kNone;
}

// The place of a marker in a blob that it shares, as a ray; made once a set. Without room the whole blob stands for it.
const RayQuadric& ExpectedMatcher::shared_quadric(const ViewRays& view, Held& one) {
  if (one.quadric == kNone) {
    if (shared_quadrics_.size() == kMaxShared) return view.quadric[one.ray];
    const Eigen::Vector2d at = Eigen::Vector2d(view.x(one.ray), view.y(one.ray)) + one.off.cast<double>();
    one.quadric = static_cast<std::uint32_t>(shared_quadrics_.size());
    shared_quadrics_.push_back(
        geometry::quadric_of(*view.rows, {{at}, view.rays[one.ray].px_from_ray}, static_cast<double>(one.sigma_px)));
  }
  return shared_quadrics_[one.quadric];
}

// Whether the two sightings in front look from directions that differ enough.
bool ExpectedMatcher::tell_depth(const RayTable& rays, std::size_t marker) const {
  const auto direction = [&](std::size_t i) {
    const std::uint32_t view = sightings_[i].source;
    return rays[view].direction(held(marker, view).ray);
  };
  return std::abs(direction(0).dot(direction(1))) < max_cos_angle_;
}

// Whether a marker's rays, three or more, all agreed at once.
bool ExpectedMatcher::take_meeting(std::size_t marker) {
  if (meetings_.rays_of(marker) < 3 || !meetings_.agree_on(marker)) return false;
  found_[marker] = meetings_.meeting(marker);
  return settings_.in_volume(found_[marker].point.v) && (!any_shared_ || has_own_ray(marker));
}

// Appends what the views hold of a marker.
void ExpectedMatcher::add_sightings(RayTable& rays, std::size_t marker) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    Held& one = held(marker, view);
    if (one.ray == kNone) continue;
    rays[view].make_quadric(one.ray);
    auto& sighting = sightings_.push_back(rays[view].sighting(one.ray, static_cast<std::uint32_t>(view)));
    if (one.sigma_px == 0.0F) continue;
    sighting.quadric = &shared_quadric(rays[view], one);
    if (one.quadric != kNone) sighting.sigma_px = static_cast<double>(one.sigma_px);
  }
}

// How many of a marker's views agree; the others are given back.
std::size_t ExpectedMatcher::agree(RayTable& rays, std::size_t marker, const WorldPoint& start) {
  sightings_.clear();
  add_sightings(rays, marker);
  if (sightings_.size() < 2) return sightings_.size();
  const auto agreed = geometry::agree(sightings_, start, agreement_);
  if (!agreed || (agreed->kept == 2 && !tell_depth(rays, marker))) return 0;
  if (!settings_.in_volume(agreed->refined.point.v)) return 0;
  found_[marker] = agreed->refined;
  for (std::size_t i = agreed->kept; i < sightings_.size(); ++i) {
    held(marker, sightings_[i].source) = {};
  }
  return has_own_ray(marker) ? agreed->kept : 0;
}

// Where the point is known now, a view that gave no blob or a wrong one is asked again.
void ExpectedMatcher::recover(RayTable& rays, std::size_t marker) {
  const geometry::Refined found = found_[marker];
  bool added = false;
  rays.cast_shadows(found.point.v, found.covariance_m2, settings_.agree_sigmas, settings_.calibration_px);
  for (std::size_t view = 0; view < view_count_; ++view) {
    Held& one = held(marker, view);
    if (one.ray != kNone) continue;
    const auto nearest = rays.nearest_free(view);
    if (!nearest) continue;
    if (!added) mark(rays, marker, -1);
    one = {};
    one.ray = static_cast<std::uint32_t>(*nearest);
    added = true;
  }
  if (!added) return;
  views_of_[marker] = static_cast<std::uint32_t>(agree(rays, marker, found.point));
  if (views_of_[marker] >= 2) mark(rays, marker, +1);
}

}  // namespace mocap::stages
