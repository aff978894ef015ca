#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "associate/predicted/predicted_matcher.h"
#include "associate/single_view/association_log_odds.h"

// What is known of a marker by its blobs' 2D tracks, by two views alone, or by one.

namespace mocap::associate {
namespace {

constexpr std::uint32_t kNone = Held::kNone;
// A 2D track leaps to another marker in one of a thousand images; natural logarithm.
constexpr double kLnTrust = 6.9;
// In every second set or so a marker that one view alone shows, or none, meets a blob of something else within its
// gate: of these, one in so many (33) for each view that might have one is believed, and 2D tracks hold back the most.
constexpr double kLnSurePair = 3.5;
// A camera that saw a marker sees it in the next set in nine cases of ten.
constexpr double kLnLostView = 2.3;
// A marker that one camera alone saw comes into another's view in one set of a hundred, and has a 2D track there soon;
// what flashes has none.
constexpr double kLnComesIntoView = 4.6;
// Where the 2D track of a marker that a camera alone sees broke, the blob near by is the marker's in nine cases of ten;
// hidden markers come into a camera's view once in a second or two.
constexpr double kLnGoesOn = 4.0;
// One blob alone only keeps a track in place.
constexpr double kLnSureLone = 4.6;
// And is another's if that is not less likely by this.
constexpr double kLnRival = 3.0;
// Of a marker that is known less well than hidden neighbours lie apart nobody can say which of them a lone blob is.
constexpr double kUnknown_m = 0.02;
// Points of two expected markers that lie farther apart are two markers.
constexpr double kOne_m = 0.02;

LoneSighting lone_sighting(const ViewRays& view, std::size_t ray, std::size_t marker, std::size_t index) {
  // A patch of the plane at distance 1 is seen under its area over the cube of its distance.
  const double solid_angle_1_px2 = std::pow(1.0 + view.x(ray) * view.x(ray) + view.y(ray) * view.y(ray), -1.5) /
                                   view.rays[ray].px_from_ray.determinant();
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

// Whose each blob is, by what its 2D track was before.
void ExpectedMatcher::find_owners(const BlobFrame& frame, const ViewRays& view, std::size_t index) {
  owners_.see(frame.camera);
  has_owners_[index] = 0;
  std::uint32_t* const owners = owner_.data() + index * kMaxBlobs;
  std::fill_n(owners, view.size(), BlobOwners::kNobody);
  if (!view.any_track) return;
  for (std::size_t ray = 0; ray < view.size(); ++ray) {
    owners[ray] = owners_.owner_of(frame.camera, view.track[ray]);
    if (owners[ray] != BlobOwners::kNobody) has_owners_[index] = 1;
  }
  for (const std::uint32_t marker : owners_.seen_alone(frame.camera)) {
    if (broken_.size() == broken_.capacity() || std::find(owners, owners + view.size(), marker) != owners + view.size())
      continue;
    broken_.push_back({static_cast<std::uint32_t>(index), marker});
    has_owners_[index] = 1;
  }
}

// Whether the 2D track of a blob was another marker's; unless that one surely lies elsewhere, and the 2D track leapt.
bool ExpectedMatcher::is_others(const RayTable& rays, std::size_t marker, std::size_t view) const {
  const Kept& kept = held_(marker, view);
  if (!kept.has_ray()) return false;
  const std::uint16_t ray = kept.ray;
  const std::uint32_t whose = owner(view, ray);
  if (whose == marker || whose == BlobOwners::kNobody) return false;
  if (whose == BlobOwners::kStranger || views_of_[whose] < 3) return true;
  return rays[view].off_px(ray, found_[whose].point) <
         settings_.agree_sigmas * std::hypot(error_.px(), rays[view].sigma_px[ray]);
}

std::size_t ExpectedMatcher::own_views(std::size_t marker) const {
  std::size_t count = 0;
  for (const Kept& kept : held_.of(marker)) count += kept.own ? 1 : 0;
  return count;
}

void ExpectedMatcher::learn_owners(const FrameSet& frames, const RayTable& rays) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const ViewRays& own = rays[view];
    if (!own.any_track) continue;
    for (std::size_t m = 0; m < marker_count_; ++m) {
      const Kept& one = held_(m, view);
      if (views_of_[m] < 3 || !one.has_ray() || one.is_shared() || one.own) continue;
      owners_.learn(frames.views[view]->camera, own.track[one.ray], static_cast<std::uint32_t>(m));
    }
  }
}

// A marker that two views alone show, where nothing that is known better has their blobs.
void ExpectedMatcher::settle_pair(RayTable& rays, std::size_t marker, const ExpectedMarker& expected) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Kept& one = held_(marker, view);
    if (!one.has_ray() || one.is_shared() || rays[view].taken[one.ray] == 0) continue;
    held_.drop(marker, view);
    views_of_[marker] = 1;
  }
  if (views_of_[marker] == 2) {
    mark(rays, marker, +1);
    recover(rays, marker);
    if (views_of_[marker] != 2 || is_believed(rays, marker, expected)) return;
    mark(rays, marker, -1);
  }
  keep_own(rays, marker, expected);
}

// Whether both blobs of a marker that two views alone show are hardly anything else's.
bool ExpectedMatcher::is_believed(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) const {
  const bool was_lone = expected.cameras < 2 && own_views(marker) == 1;
  // Any of the other views might have had a blob of something else; and where more saw it just now, it lies elsewhere.
  double against = std::log(std::max(1.0, static_cast<double>(view_count_) - 1.0));
  if (expected.cameras > 2) against += kLnLostView * (expected.cameras - 2.0);
  BoundedVector<PairView, 2> pair;
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Held held = held_.held(marker, view);
    if (held.ray == kNone) continue;
    if (held.hidden || is_others(rays, marker, view)) return false;
    const bool perhaps_flashed = !held_(marker, view).own && !rays[view].track[held.ray].names_something();
    if (was_lone && perhaps_flashed) against += kLnComesIntoView;
    PairView& one = pair.push_back(pair_view(rays[view], held, found_[marker].point, error_.px()));
    if (held_(marker, view).own) one.others_1_px2 *= std::exp(-kLnTrust);
  }
  const auto off2 = [](const PairView& view) { return view.off_px.squaredNorm() / (view.sigma_px * view.sigma_px); };
  if (off2(pair[0]) + off2(pair[1]) > settings_.agree_sigmas * settings_.agree_sigmas) return false;
  const Eigen::Vector3d ahead = expected.position.v - found_[marker].point.v;
  return log_odds_of_pair(pair[0], pair[1], ahead, expected.covariance_m2) > kLnSurePair + against;
}

// Of a pair that is not believed, the view that was the marker's before: by its 2D track, else because it alone has a
// blob where the marker is foreseen. What one camera sees must not be lost because another sees something else nearby.
void ExpectedMatcher::keep_own(const RayTable& rays, std::size_t marker, const ExpectedMarker& expected) {
  std::size_t kept = view_count_;
  const std::size_t own = own_views(marker);
  if (own == 0) kept = likely_view(rays, marker, expected);
  for (std::size_t view = 0; view < view_count_ && own == 1; ++view) {
    if (held_(marker, view).own) kept = view;
  }
  for (std::size_t view = 0; view < view_count_; ++view) {
    if (view != kept) held_.drop(marker, view);
  }
  views_of_[marker] = kept < view_count_ ? 1 : 0;
}

// The only view whose blob is surely no other's; the number of views where none is, or two are.
std::size_t ExpectedMatcher::likely_view(const RayTable& rays, std::size_t marker,
                                         const ExpectedMarker& expected) const {
  std::size_t likely = view_count_;
  for (std::size_t view = 0; view < view_count_; ++view) {
    const Kept& one = held_(marker, view);
    if (!one.has_ray() || !(log_odds_of_lone(rays[view], one.ray, expected, error_.px()) > kLnSureLone)) continue;
    if (likely < view_count_) return view_count_;
    likely = view;
  }
  return likely;
}

// Whether this view alone saw the marker a moment ago by a 2D track that is gone.
bool ExpectedMatcher::is_broken(std::size_t view, std::size_t marker) const {
  return std::any_of(broken_.begin(), broken_.end(),
                     [&](const Broken& one) { return one.view == view && one.marker == marker; });
}

// What the 2D track of a blob adds to the cost of its being the marker's.
double ExpectedMatcher::odds_of_owner(std::size_t marker, std::size_t view, std::size_t ray) const {
  if (has_owners_[view] == 0) return 0.0;
  const std::uint32_t whose = owner(view, ray);
  if (whose == BlobOwners::kNobody) return is_broken(view, marker) ? -2.0 * kLnGoesOn : 0.0;
  return whose == marker ? -2.0 * kLnTrust : 2.0 * kLnTrust;
}

// A marker that leapt out of its gate is known by its 2D track; whether it really did the other views tell.
void ExpectedMatcher::claim_own(const ViewRays& view, std::size_t index) {
  for (std::uint32_t ray = 0; ray < view.size(); ++ray) {
    const std::uint32_t whose = owner(index, ray);
    if (whose >= marker_count_ || view_holds_.holder(ray) != kNone || view_holds_.rays()[whose] != kNone) continue;
    view_holds_.hold(whose, ray);
  }
}

// What else may have made the blob: markers that hardly any view shows, by how likely each is.
ExpectedMatcher::Rivals ExpectedMatcher::rivals_of(const ViewRays& view, std::size_t ray, std::size_t marker,
                                                   double odds, const Expected& expected) const {
  Rivals rivals;
  double total = 1.0;
  double square_m2 = 0.0;
  for (std::size_t other = 0; other < marker_count_; ++other) {
    if (other == marker || views_of_[other] > 1) continue;
    const ExpectedMarker& one = expected.markers.data()[other];
    const double ahead = log_odds_of_lone(view, ray, one, error_.px()) - odds;
    if (!std::isfinite(ahead)) continue;
    if (ahead > -kLnRival) rivals.none = false;
    const Eigen::Vector3d apart = one.position.v - expected.markers.data()[marker].position.v;
    const double share = std::exp(std::min(0.0, ahead));
    total += share;
    rivals.off_m += share * apart;
    square_m2 += share * apart.squaredNorm();
  }
  rivals.off_m /= total;
  rivals.spread_m = std::sqrt(std::max(0.0, square_m2 / total - rivals.off_m.squaredNorm()) / 3.0);
  return rivals;
}

// Whichever it is that is seen: the marker lies beside the ray by what those that it may be lie apart.
void ExpectedMatcher::put_aside(const Rivals& rivals, const ExpectedMarker& expected, LoneSighting& lone) {
  const double depth_m = (expected.position.v - lone.eye.v).dot(lone.direction);
  if (!(depth_m > 0.0)) return;
  lone.direction = (depth_m * lone.direction - rivals.off_m).normalized();
  lone.sigma_rad = std::hypot(lone.sigma_rad, rivals.spread_m / depth_m);
}

void ExpectedMatcher::list_lone(const FrameSet& frames, const RayTable& rays, const Expected& expected, Matches& into) {
  for (std::size_t m = 0; m < marker_count_; ++m) {
    if (views_of_[m] != 1) continue;
    const ExpectedMarker& marker = expected.markers.data()[m];
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Kept& one = held_(m, view);
      const std::uint16_t ray = one.ray;
      if (!one.has_ray() || rays[view].taken[ray] != 0 || !held_.is_alone(view, ray) || is_others(rays, m, view)) {
        continue;
      }
      const double odds = log_odds_of_lone(rays[view], ray, marker, error_.px());
      if (!one.own && !(odds > kLnSureLone)) continue;
      LoneSighting lone = lone_sighting(rays[view], ray, m, view);
      Rivals rivals;
      if (!one.own && !is_broken(view, m)) rivals = rivals_of(rays[view], ray, m, odds, expected);
      const bool unknown = marker.covariance_m2.trace() > 3.0 * kUnknown_m * kUnknown_m;
      if (!rivals.none && unknown) put_aside(rivals, marker, lone);
      if (!into.lone.try_push_back(lone)) return;
      if (!rivals.none) continue;
      const CameraId camera = frames.views[view]->camera;
      owners_.see_alone(camera, lone.expected);
      owners_.learn(camera, rays[view].track[ray], lone.expected);
    }
  }
}

// Two tracks of one marker would share its views for ever, each with half of them: where all of both agree on one
// point, the older has them.
void ExpectedMatcher::join_older(RayTable& rays, std::size_t marker) {
  if (views_of_[marker] < 2 || 2 * views_of_[marker] > view_count_) return;
  for (std::size_t older = 0; older < marker_count_; ++older) {
    if (older == marker || views_of_[older] < 2 || views_of_[older] + views_of_[marker] > view_count_) continue;
    if ((found_[older].point.v - found_[marker].point.v).squaredNorm() > kOne_m * kOne_m) continue;
    bool apart = false;
    for (std::size_t view = 0; view < view_count_; ++view) {
      apart = apart || (held_(older, view).has_ray() && held_(marker, view).has_ray());
    }
    if (apart) continue;
    sightings_.clear();
    add_sightings(rays, older);
    add_sightings(rays, marker);
    const auto agreed = geometry::agree(sightings_, found_[older].point, agreement_);
    if (!agreed || agreed->kept != sightings_.size()) continue;
    const std::size_t keeper = std::min(older, marker), other = std::max(older, marker);
    for (std::size_t view = 0; view < view_count_; ++view) {
      const Kept& given = held_(other, view);
      held_.hand_over(keeper, other, view, given.has_ray() && owner(view, given.ray) == keeper);
    }
    found_[keeper] = agreed->refined;
    views_of_[keeper] = static_cast<std::uint32_t>(agreed->kept);
    views_of_[other] = 0;
    met_[keeper] = met_[other] = 0;
    return;
  }
}

}  // namespace mocap::associate
