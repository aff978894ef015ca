#include "associate/predicted/predicted_matcher.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace mocap::associate {
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
      gate2_(settings.gate_sigmas * settings.gate_sigmas),
      widest_(std::max(0.0, gate2_ - 4.0)),
      assigner_(kMaxMarkers, kMaxBlobs, kMaxGateCandidates),
      sharer_(kMaxMarkers),
      gates_(settings_),
      owners_(camera_count),
      meetings_(kMaxMarkers, camera_count),
      camera_count_(camera_count),
      view_count_(camera_count),
      column_of_(kMaxBlobs, kNone),
      view_holds_(kMaxMarkers),
      holder_cost_(kMaxBlobs, 0.0),
      faithful_(kMaxBlobs, 0),
      held_(kMaxMarkers, camera_count),
      owner_(camera_count * kMaxBlobs, BlobOwners::kNobody),
      has_owners_(camera_count, 0),
      found_(kMaxMarkers),
      views_of_(kMaxMarkers, 0),
      met_(kMaxMarkers, 0) {
  pairs_.reserve(kMaxGateCandidates);
  several_.reserve(kMaxGateCandidates);
  contested_.reserve(kMaxGateCandidates);
  row_markers_.reserve(kMaxMarkers);
  column_rays_.reserve(kMaxBlobs);
  shared_quadrics_.reserve(kMaxShared);
  broken_.reserve(kMaxMarkers);
}

void ExpectedMatcher::match(const FrameSet& frames, RayTable& rays, const Expected& expected, Matches& into) {
  const std::size_t count = expected.markers.size();
  view_count_ = rays.view_count();
  marker_count_ = count;
  shared_quadrics_.clear();
  held_.begin(count, view_count_);
  gates_.expect(expected);
  owners_.expect(expected);
  broken_.clear();
  meetings_.begin(expected);
  // All of a view at once: its numbers are in the cache then.
  for (std::size_t view = 0; view < view_count_; ++view) {
    rays.cast(view);
    if (count == 0) continue;
    find_owners(*frames.views[view], rays[view], view);
    const bool shared = assign_view(rays[view], view);
    held_.keep(view, rays[view], view_holds_, std::span(owner_).subspan(view * kMaxBlobs, kMaxBlobs), shared);
    meetings_.add(rays[view], view_holds_);
  }
  if (count == 0) {
    rays.list_free(settings_.agree_sigmas);
    return;
  }
  if (held_.any_shared()) forsake_doubles();
  meetings_.solve();
  meetings_.judge(agreement_);

  for (std::size_t m = 0; m < count; ++m) {
    const bool met = take_meeting(m);
    views_of_[m] =
        static_cast<std::uint32_t>(met ? meetings_.rays_of(m) : agree(rays, m, expected.markers.data()[m].position));
  }
  for (std::size_t m = count; m-- > 0;) join_older(rays, m);
  // What three or more views tell goes before what two do.
  take_sure(rays);
  rays.list_free(settings_.agree_sigmas);
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
      const Kept& one = held_(m, view);
      if (!one.has_ray() || one.is_shared()) continue;
      const ViewRays& own = rays[view];
      error_.learn(view, own.off_px(one.ray, found_[m].point), own.sigma_px[one.ray], views_of_[m]);
    }
  }
  agreement_.floor_px = settings_.agree_sigmas * error_.px();
}

void ExpectedMatcher::mark(RayTable& rays, std::size_t marker, int change) const {
  for (std::uint64_t views = held_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const std::uint16_t ray = held_(marker, view).ray;
    if (change > 0) {
      rays[view].take(ray);
    } else {
      rays[view].give_back(ray);
    }
  }
}

// The rays of all markers that three or more views agree on: all that were held, but for those given up and those of
// the few other markers.
void ExpectedMatcher::take_sure(RayTable& rays) const {
  for (std::size_t view = 0; view < view_count_; ++view) rays[view].take_all(held_.holders(view));
  for (const auto& [view, ray] : held_.given_up()) rays[view].give_back(ray);
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (views_of_[m] < 3) mark(rays, m, -1);
  }
}

void ExpectedMatcher::give(const RayTable& rays, std::size_t marker, Matches& into) const {
  if (into.matches.full()) {
    ++into.dropped;
    return;
  }
  Match& match = into.matches.push_back(none_);
  match.expected = static_cast<std::uint32_t>(marker);
  match.by_blob_tracks = own_views(marker) >= 2;
  const geometry::Refined& found = found_[marker];
  match.meeting = {found.point, found.covariance_m2, found.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (std::uint64_t views = held_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const Kept& one = held_(marker, view);
    BlobRef& seen = match.sightings.push_back({static_cast<std::uint16_t>(view), one.blob, 0.0F, 0.0F, one.sigma_px});
    if (!one.is_shared()) continue;
    const geometry::RayColumns& slope = rays[view].rays;
    const Eigen::Vector2d off = held_.place(one).off.cast<double>();
    seen.off_x_px = static_cast<float>(slope.ux[one.ray] * off.x() + slope.uy[one.ray] * off.y());
    seen.off_y_px = static_cast<float>(slope.vx[one.ray] * off.x() + slope.vy[one.ray] * off.y());
  }
}

// A marker that shares all its blobs may be there or not; the others explain the blobs without it. The last born is the
// first to go: two tracks of one marker must not live on each other's blobs.
void ExpectedMatcher::forsake_doubles() {
  for (std::size_t m = marker_count_; m-- > 0;) {
    if (!held_.has_own_ray(m)) held_.forsake(m);
  }
}

// How unlikely the pair is. How much wider the gate is than its floor enters: of two markers that fit a blob equally
// well the surer one has it, and of two blobs the surer one is had. A gate never shrinks below two standard deviations,
// however unsure the marker is.
double ExpectedMatcher::cost_of(const GateCandidate& candidate) const {
  return static_cast<double>(candidate.distance2) +
         std::min(static_cast<double>(std::log(std::max(1.0F, candidate.widening))), widest_);
}

// All expected markers of one view at once: the exact assignment by likelihood. Most markers and rays have nobody else,
// or several have one and the same alone: these need no assignment. Says whether any ray is shared.
bool ExpectedMatcher::assign_view(const ViewRays& view, std::size_t index) {
  view_holds_.begin(marker_count_, view.size());
  if (view.size() == 0) return false;
  const std::span<const GateCandidate> candidates = gates_.candidates(view);
  assign_the_alone(candidates, index);
  if (!several_.empty()) assign_several(candidates, index);
  if (has_owners_[index] != 0) claim_own(view, index);
  return sharer_.share(view, gates_.bins(), gates_.foreseen(), view_holds_);
}

// A marker and a ray that have nobody else. The logarithm in the cost is dear: where even 1 + log <= widening passes,
// it is not asked. Others are several.
void ExpectedMatcher::assign_the_alone(std::span<const GateCandidate> candidates, std::size_t index) {
  const auto passes = static_cast<float>(gate2_) + 1.0F;
  const bool told = has_owners_[index] != 0;
  const std::size_t count = candidates.size();
  several_.clear();
  std::uint32_t before = kNone;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto& [marker, ray, distance2, widening] = candidates[i];
    const std::uint32_t after = i + 1 < count ? candidates[i + 1].marker : kNone;
    const bool many = (marker == before) | (marker == after);
    before = marker;
    if (many | (gates_.wanted_by(ray) != 1) | told | !(distance2 + widening < passes)) {
      several_.push_back(i);
      continue;
    }
    view_holds_.hold(marker, ray);
  }
}

// All other candidates, marker by marker.
void ExpectedMatcher::assign_several(std::span<const GateCandidate> candidates, std::size_t index) {
  const auto marker = [&](std::size_t i) { return candidates[several_[i]].marker; };
  const auto last_of = [&](std::size_t first) {
    std::size_t last = first + 1;
    while (last < several_.size() && marker(last) == marker(first)) ++last;
    return last;
  };
  for (const std::uint32_t i : several_) faithful_[candidates[i].ray] = 0;
  for (std::size_t first = 0; first < several_.size();) {
    const std::size_t last = last_of(first);
    if (last - first == 1) ++faithful_[candidates[several_[first]].ray];
    first = last;
  }
  contested_.clear();
  for (std::size_t first = 0; first < several_.size();) {
    const std::size_t last = last_of(first);
    assign_marker(candidates, std::span(several_).subspan(first, last - first), index);
    first = last;
  }
  if (!contested_.empty()) assign_contested(candidates, index);
}

// One marker's. Where one ray is wanted by such only as want nothing else, or one marker wants such only as nobody else
// wants, the cheapest is the best.
void ExpectedMatcher::assign_marker(std::span<const GateCandidate> candidates, std::span<const std::uint32_t> wanted,
                                    std::size_t index) {
  bool star = true;
  for (const std::uint32_t i : wanted) {
    const std::uint32_t ray = candidates[i].ray;
    star = star && gates_.wanted_by(ray) == (wanted.size() == 1 ? faithful_[ray] : 1);
  }
  for (const std::uint32_t i : wanted) {
    const GateCandidate& one = candidates[i];
    if (star) {
      offer(one, cost_of(one) + odds_of_owner(one.marker, index, one.ray));
    } else {
      contested_.push_back(i);
    }
  }
}

// Holds the cheaper of what a ray or a marker of a star has and what it is offered.
void ExpectedMatcher::offer(const GateCandidate& candidate, double cost) {
  const std::uint32_t had = view_holds_.rays()[candidate.marker];
  const std::uint32_t holder = view_holds_.holder(candidate.ray);
  if (cost >= gate2_ || (had != kNone && holder_cost_[had] <= cost) ||
      (holder != kNone && holder_cost_[candidate.ray] <= cost)) {
    return;
  }
  if (had != kNone) view_holds_.let_go(candidate.marker);
  if (holder != kNone) view_holds_.let_go(holder);
  view_holds_.hold(candidate.marker, candidate.ray);
  holder_cost_[candidate.ray] = cost;
}

void ExpectedMatcher::assign_contested(std::span<const GateCandidate> candidates, std::size_t index) {
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
  const auto columns = assigner_.assign(row_markers_.size(), column_rays_.size(), pairs_, gate2_);
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (columns[row] == geometry::Assigner::kAlone) continue;
    view_holds_.hold(row_markers_[row], column_rays_[columns[row]]);
  }
  for (const std::uint32_t ray : column_rays_) column_of_[ray] = kNone;
}

// The place of a marker in a blob that it shares, as a ray; made once a set. Without room the whole blob stands for it.
const geometry::RayQuadric& ExpectedMatcher::shared_quadric(const ViewRays& view, Held& place) {
  if (place.quadric == kNone) {
    if (shared_quadrics_.size() == kMaxShared) return view.quadric[place.ray];
    const Eigen::Vector2d at = Eigen::Vector2d(view.x(place.ray), view.y(place.ray)) + place.off.cast<double>();
    place.quadric = static_cast<std::uint32_t>(shared_quadrics_.size());
    shared_quadrics_.push_back(geometry::quadric_of(*view.rows, {{at}, view.rays[place.ray].px_from_ray},
                                                    static_cast<double>(place.sigma_px)));
  }
  return shared_quadrics_[place.quadric];
}

// Whether the two sightings in front look from directions that differ enough.
bool ExpectedMatcher::tell_depth(const RayTable& rays, std::size_t marker) const {
  const auto direction = [&](std::size_t i) {
    const std::uint32_t view = sightings_[i].source;
    return rays[view].direction(held_(marker, view).ray);
  };
  return std::abs(direction(0).dot(direction(1))) < max_cos_angle_;
}

// Whether a marker's rays, three or more, all agreed at once, or nearly all of many.
bool ExpectedMatcher::take_meeting(std::size_t marker) {
  met_[marker] = 0;
  if (meetings_.rays_of(marker) < 3) return false;
  if (!meetings_.agree_on(marker) && !leave_out_worst(marker)) return false;
  met_[marker] = 1;
  found_[marker] = meetings_.meeting(marker);
  return settings_.in_volume(found_[marker].point.v) && (!held_.any_shared() || held_.has_own_ray(marker));
}

// Whether the rays of a marker agree but for some that are odd, which are given back.
bool ExpectedMatcher::leave_out_worst(std::size_t marker) {
  const auto left_out = meetings_.settle(marker, agreement_);
  if (!left_out) return false;
  for (std::uint64_t views = *left_out; views != 0; views &= views - 1) {
    held_.drop(marker, static_cast<std::size_t>(std::countr_zero(views)));
  }
  return true;
}

// Appends what the views hold of a marker.
void ExpectedMatcher::add_sightings(RayTable& rays, std::size_t marker) {
  for (std::uint64_t views = held_.views(marker); views != 0; views &= views - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(views));
    const Kept& one = held_(marker, view);
    rays[view].make_quadric(one.ray);
    auto& sighting = sightings_.push_back(rays[view].sighting(one.ray, static_cast<std::uint32_t>(view)));
    if (!one.is_shared()) continue;
    Held& place = held_.place(one);
    sighting.quadric = &shared_quadric(rays[view], place);
    if (place.quadric != kNone) sighting.sigma_px = static_cast<double>(one.sigma_px);
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
    held_.drop(marker, sightings_[i].source);
  }
  return held_.has_own_ray(marker) ? agreed->kept : 0;
}

// Where the point is known now, a view that gave no blob or a wrong one is asked again.
void ExpectedMatcher::recover(RayTable& rays, std::size_t marker) {
  const geometry::Refined found = found_[marker];
  const std::size_t given_up = held_.given_up().size();
  bool added = false;
  rays.cast_shadows(found.point.v, found.covariance_m2, settings_.agree_sigmas, settings_.calibration_px);
  const std::uint64_t all = ~std::uint64_t{0} >> (kMaxCameras - view_count_);
  for (std::uint64_t lacking = all & ~held_.views(marker); lacking != 0; lacking &= lacking - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(lacking));
    const auto nearest = rays.nearest_free(view);
    if (!nearest) continue;
    rays[view].take(*nearest);
    held_.give(marker, view, rays[view], *nearest, owner(view, *nearest) == marker);
    if (met_[marker] != 0) meetings_.add_ray(marker, view, rays[view], *nearest);
    added = true;
  }
  if (!added) return;
  const bool met = met_[marker] != 0 && leave_out_worst(marker);
  if (met) found_[marker] = meetings_.meeting(marker);
  const bool near = met && settings_.in_volume(found_[marker].point.v) && held_.has_own_ray(marker);
  views_of_[marker] = static_cast<std::uint32_t>(near ? meetings_.rays_of(marker) : agree(rays, marker, found.point));
  for (const auto& [view, ray] : held_.given_up().subspan(given_up)) rays[view].give_back(ray);
  if (views_of_[marker] < 2) mark(rays, marker, -1);
}

}  // namespace mocap::associate
