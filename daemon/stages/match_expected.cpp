#include "stages/match_expected.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::stages {
namespace {

constexpr std::uint32_t kNone = Held::kNone;
// More blobs than that in the gates of all markers of one view: the gates tell nothing any more.
constexpr std::size_t kMaxPairs = 16 * kMaxMarkers;

bool is_usable(const ExpectedMarker& marker) {
  return marker.position.v.allFinite() && marker.covariance_m2.allFinite() &&
         (marker.covariance_m2.diagonal().array() >= 0.0).all();
}

// How much wider the gate is than its floor, as it enters the likelihood: of two markers that fit a blob equally well
// the surer one has it, and of two blobs the surer one is had. `own` is what floor and blob add to the shadow.
double width_of(const Shadow& shadow, double own, double floor) {
  const double xx = shadow.covariance(0, 0) + own;
  const double yy = shadow.covariance(1, 1) + own;
  const double xy = shadow.covariance(0, 1);
  return std::log(std::max(1.0, (xx * yy - xy * xy) / (floor * floor)));
}

LoneSighting lone_sighting(const ViewRays& view, std::size_t ray, std::size_t marker, std::size_t index) {
  // A patch of the plane at distance 1 is seen under its area over the cube of its distance.
  const double solid_angle_1_px2 =
      std::pow(1.0 + view.x[ray] * view.x[ray] + view.y[ray] * view.y[ray], -1.5) / view.px_from_ray[ray].determinant();
  LoneSighting lone;
  lone.expected = static_cast<std::uint32_t>(marker);
  lone.sighting = {static_cast<std::uint16_t>(index), view.blob[ray], 0.0F, 0.0F,
                   static_cast<float>(view.sigma_px[ray])};
  lone.eye = view.camera->centre();
  lone.direction = view.direction(ray);
  lone.sigma_rad = view.sigma_px[ray] * std::sqrt(solid_angle_1_px2);
  return lone;
}

}  // namespace

ExpectedMatcher::ExpectedMatcher(const MatchSettings& settings, std::size_t camera_count)
    : settings_(settings),
      agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
      max_cos_angle_(std::cos(settings.min_ray_angle_deg * std::numbers::pi / 180.0)),
      assigner_(kMaxMarkers, kMaxBlobs, kMaxPairs),
      sharer_(kMaxMarkers),
      view_count_(camera_count),
      foreseen_(kMaxMarkers),
      held_(kMaxMarkers * camera_count),
      holders_(camera_count * kMaxBlobs, 0),
      found_(kMaxMarkers),
      views_of_(kMaxMarkers, 0) {
  pairs_.reserve(kMaxPairs);
}

void ExpectedMatcher::match(RayTable& rays, const Expected& expected, Matches& into) {
  const std::size_t count = expected.markers.size();
  view_count_ = rays.view_count();
  marker_count_ = count;
  std::fill_n(held_.begin(), count * view_count_, Held{});
  for (std::size_t view = 0; view < view_count_; ++view) assign_view(rays[view], view, expected);
  forsake_doubles(rays);

  for (std::size_t m = 0; m < count; ++m) {
    views_of_[m] = static_cast<std::uint32_t>(agree(rays, m));
    if (views_of_[m] == 1) ++into.seen_once;
    if (views_of_[m] >= 2) mark(rays, m, +1);
  }
  for (std::size_t m = 0; m < count; ++m) {
    if (views_of_[m] < 2) continue;
    if (views_of_[m] < view_count_) recover(rays, m);
    if (views_of_[m] >= 2) give(rays, m, into);
  }
}

void ExpectedMatcher::list_lone(const RayTable& rays, Matches& into) const {
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (views_of_[m] != 1) continue;
    for (std::size_t view = 0; view < view_count_; ++view) {
      const std::uint32_t ray = held(m, view).ray;
      if (ray == kNone || rays[view].taken[ray] != 0 || holders(view, ray) != 1) continue;
      if (!into.lone.try_push_back(lone_sighting(rays[view], ray, m, view))) return;
    }
  }
}

void ExpectedMatcher::mark(RayTable& rays, std::size_t marker, int change) const {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t ray = held(marker, view).ray;
    if (ray != kNone) rays[view].taken[ray] = static_cast<std::uint8_t>(rays[view].taken[ray] + change);
  }
}

void ExpectedMatcher::give(const RayTable& rays, std::size_t marker, Matches& into) const {
  Match match;
  match.expected = static_cast<std::uint32_t>(marker);
  for (std::size_t view = 0; view < view_count_; ++view) {
    const auto& [ray, off, sigma_px] = held(marker, view);
    if (ray == kNone) continue;
    const Eigen::Vector2f off_px = (rays[view].px_from_ray[ray] * off).cast<float>();
    match.sightings.push_back({static_cast<std::uint16_t>(view), rays[view].blob[ray], off_px.x(), off_px.y(),
                               static_cast<float>(sigma_px > 0.0 ? sigma_px : rays[view].sigma_px[ray])});
  }
  if (!into.matches.try_push_back(match)) ++into.dropped;
}

// Whether a view shows this marker and no other.
bool ExpectedMatcher::has_own_ray(std::size_t marker) const {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t ray = held(marker, view).ray;
    if (ray != kNone && holders(view, ray) == 1) return true;
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

// All expected markers of one view at once: the exact assignment by likelihood.
void ExpectedMatcher::assign_view(const ViewRays& view, std::size_t index, const Expected& expected) {
  const double gate2 = settings_.gate_sigmas * settings_.gate_sigmas;
  // A gate never shrinks below two standard deviations, however unsure the marker is.
  const double widest = std::max(0.0, gate2 - 4.0);
  const double floor = std::pow(settings_.gate_floor_px / view.focal_px, 2);

  pairs_.clear();
  for (std::size_t m = 0; m < expected.markers.size(); ++m) {
    const ExpectedMarker& marker = expected.markers.data()[m];
    foreseen_[m].usable = false;
    if (!is_usable(marker)) continue;
    const auto shadow = view.shadow(marker.position.v, marker.covariance_m2);
    if (!shadow) continue;
    foreseen_[m] = {shadow->centre, view.focal_px * std::sqrt(0.5 * shadow->covariance.trace()), true};
    const auto [first, last] = view.candidates(*shadow, settings_.gate_sigmas, settings_.gate_floor_px);
    if (first == last) continue;
    const double usual_width = std::min(width_of(*shadow, floor, floor), widest);
    for (std::size_t ray = first; ray < last; ++ray) {
      const double own = std::pow(view.sigma_px[ray] / view.focal_px, 2);
      // The logarithm is dear, and most blobs are far surer than the floor.
      const double width = own < 0.1 * floor ? usual_width : std::min(width_of(*shadow, floor + own, floor), widest);
      const double cost = view.distance2(*shadow, ray, settings_.gate_floor_px) + width;
      if (!(cost < gate2) || pairs_.size() == kMaxPairs) continue;
      pairs_.push_back({static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(ray), cost});
    }
  }
  if (pairs_.empty()) return;
  const auto columns = assigner_.assign(expected.markers.size(), view.size(), pairs_, gate2);
  for (std::size_t m = 0; m < columns.size(); ++m) {
    if (columns[m] != geometry::Assigner::kAlone) held(m, index).ray = columns[m];
  }
  sharer_.share(view, std::span(foreseen_).first(marker_count_),
                std::span(held_).subspan(index * marker_count_, marker_count_));
}

// Whether the two sightings in front look from directions that differ enough.
bool ExpectedMatcher::tell_depth(const RayTable& rays, std::size_t marker) const {
  const auto direction = [&](std::size_t i) {
    const std::uint32_t view = sightings_[i].source;
    return rays[view].direction(held(marker, view).ray);
  };
  return std::abs(direction(0).dot(direction(1))) < max_cos_angle_;
}

// How many of a marker's views agree; the others are given back.
std::size_t ExpectedMatcher::agree(const RayTable& rays, std::size_t marker) {
  sightings_.clear();
  for (std::size_t view = 0; view < view_count_; ++view) {
    const auto& [ray, off, sigma_px] = held(marker, view);
    if (ray == kNone) continue;
    geometry::Sighting& sighting = sightings_.push_back(rays[view].sighting(ray, static_cast<std::uint32_t>(view)));
    if (sigma_px == 0.0) continue;
    sighting.point.v += off;
    sighting.sigma_px = sigma_px;
  }
  if (sightings_.size() < 2) return sightings_.size();
  const auto agreed = geometry::agree(sightings_, agreement_);
  if (!agreed || (agreed->kept == 2 && !tell_depth(rays, marker))) return 0;
  const auto& at = agreed->refined.point.v.array();
  if ((at < settings_.volume_min_m.array()).any() || (at > settings_.volume_max_m.array()).any()) return 0;
  found_[marker] = agreed->refined;
  for (std::size_t i = agreed->kept; i < sightings_.size(); ++i) {
    held(marker, sightings_[i].source) = {};
  }
  return has_own_ray(marker) ? agreed->kept : 0;
}

// Where the point is known now, a view that gave no blob or a wrong one is asked again.
void ExpectedMatcher::recover(RayTable& rays, std::size_t marker) {
  const geometry::Refined found = found_[marker];
  mark(rays, marker, -1);
  bool added = false;
  for (std::size_t view = 0; view < view_count_; ++view) {
    std::uint32_t& ray = held(marker, view).ray;
    if (ray != kNone) continue;
    const auto shadow = rays[view].shadow(found.point.v, found.covariance_m2);
    if (!shadow) continue;
    const auto nearest = rays[view].nearest_free(*shadow, settings_.agree_sigmas, settings_.calibration_px);
    if (!nearest) continue;
    ray = static_cast<std::uint32_t>(*nearest);
    added = true;
  }
  if (added) views_of_[marker] = static_cast<std::uint32_t>(agree(rays, marker));
  if (views_of_[marker] >= 2) mark(rays, marker, +1);
}

}  // namespace mocap::stages
