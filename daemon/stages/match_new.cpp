#include "stages/match_new.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/epipolar.h"

namespace mocap::stages {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::uint32_t kNone = 0xFFFF'FFFF;
constexpr std::size_t kMaxHypotheses = 4096;
// The bound on the work for one set, in steps of about a nanosecond.
constexpr std::size_t kMaxWork = 4'000'000;
constexpr std::size_t kWorkOfShadow = 40;

// The point that all cameras look at, as well as one can say: nearest to their optical axes.
Vector3d centre_of_view(const Rig& rig) {
  Matrix3d normal = 1e-6 * Matrix3d::Identity();
  Vector3d rhs = Vector3d::Zero();
  for (const CameraModel& camera : rig) {
    const Vector3d axis = camera.camera_from_world.rotation.row(2).transpose();
    const Matrix3d across = Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    rhs += across * camera.centre().v;
  }
  return normal.inverse() * rhs;
}

}  // namespace

NewMatcher::NewMatcher(const MatchSettings& settings, const Rig& rig)
    : settings_(settings),
      agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
      max_cos_angle_(std::cos(settings.min_ray_angle_deg * std::numbers::pi / 180.0)),
      best_of_(rig.size() * kMaxBlobs, kNone),
      rivals_(rig.size() * kMaxBlobs, 0) {
  hypotheses_.reserve(kMaxHypotheses);
  open_.reserve(kMaxHypotheses);
  undecided_.reserve(kMaxHypotheses);
  plan_rounds(rig);
}

// Best suited are cameras that see the middle of the volume from 60 degrees apart: near enough to see the same side of
// a body, far enough to tell depth.
void NewMatcher::plan_rounds(const Rig& rig) {
  constexpr double kBestAngle_rad = std::numbers::pi / 3.0;
  struct Candidate {
    double fault;
    std::uint32_t a, b;
  };
  const Vector3d centre = centre_of_view(rig);
  std::vector<Candidate> candidates;
  for (std::uint32_t a = 0; a < rig.size(); ++a) {
    for (std::uint32_t b = a + 1; b < rig.size(); ++b) {
      const Vector3d to_a = (rig[a].centre().v - centre).normalized();
      const Vector3d to_b = (rig[b].centre().v - centre).normalized();
      const double angle = std::acos(std::clamp(to_a.dot(to_b), -1.0, 1.0));
      candidates.push_back({std::abs(angle - kBestAngle_rad), a, b});
    }
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::fault);
  std::vector<std::uint64_t> busy;  // by round: the cameras that have a partner
  for (const auto& [fault, a, b] : candidates) {
    const std::uint64_t both = (std::uint64_t{1} << a) | (std::uint64_t{1} << b);
    std::size_t round = 0;
    while (round < busy.size() && (busy[round] & both) != 0) ++round;
    if (round == busy.size()) busy.push_back(0);
    busy[round] |= both;
    pairs_.push_back({a, b, round, geometry::essential(rig[a].camera_from_world, rig[b].camera_from_world)});
  }
  std::ranges::stable_sort(pairs_, {}, &Pair::round);
}

void NewMatcher::match(RayTable& rays, std::uint32_t missing_views, Matches& into) {
  missing_views_ = missing_views;
  work_ = 0;
  skipped_ = 0;
  hypotheses_.clear();
  undecided_.clear();
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    const auto first = static_cast<std::ptrdiff_t>(view * kMaxBlobs);
    std::fill_n(best_of_.begin() + first, rays[view].size(), kNone);
    std::fill_n(rivals_.begin() + first, rays[view].size(), 0U);
  }

  std::size_t round = 0;
  for (const Pair& pair : pairs_) {
    if (pair.round != round) {
      decide(rays, false, into);
      round = pair.round;
    }
    ask_pair(rays, pair);
  }
  decide(rays, true, into);
  believe_lone_pairs(rays, into);
  into.skipped += skipped_;
}

void NewMatcher::ask_pair(const RayTable& rays, const Pair& pair) {
  const auto a = rays.view_of(pair.a);
  const auto b = rays.view_of(pair.b);
  if (!a || !b) return;
  const ViewRays& of_a = rays[*a];
  const ViewRays& of_b = rays[*b];
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (of_a.taken[i] != 0) continue;
    if (work_ > kMaxWork) {
      ++skipped_;
      continue;
    }
    const auto line = geometry::epipolar_line(pair.essential, {{of_a.x[i], of_a.y[i]}});
    if (line.n.isZero()) continue;  // looks right into the other camera
    work_ += of_b.size();
    // Both blobs' errors move them off the line, and so does the rig's.
    const double allowed_px = std::hypot(settings_.calibration_px, of_a.sigma_px[i]) * 2.0 * settings_.agree_sigmas;
    const double allowed = allowed_px / std::min(of_a.focal_px, of_b.focal_px);
    for (std::size_t j = 0; j < of_b.size(); ++j) {
      const double off = line.n[0] * of_b.x[j] + line.n[1] * of_b.y[j] + line.n[2];
      if (std::abs(off) > allowed || of_b.taken[j] != 0) continue;
      propose(rays, {static_cast<std::uint16_t>(*a), static_cast<std::uint16_t>(i)},
              {static_cast<std::uint16_t>(*b), static_cast<std::uint16_t>(j)});
    }
  }
}

// Whether both rays already are of one marker: asking again would give the same.
bool NewMatcher::is_explained(Member a, Member b) const { return best_of(a) != kNone && best_of(a) == best_of(b); }

void NewMatcher::propose(const RayTable& rays, Member a, Member b) {
  if (is_explained(a, b)) return;
  if (work_ > kMaxWork || hypotheses_.size() == kMaxHypotheses) {
    ++skipped_;
    return;
  }
  if (!start(rays, a, b)) return;
  gather_support(rays, trial_);
  if (trial_.members.size() > 2) {
    if (!settle(rays, trial_)) return;
    // Known better now, the point may find views that it missed, and tell near blobs apart.
    if (trial_.members.size() < rays.view_count()) {
      const std::size_t before = trial_.members.size();
      gather_support(rays, trial_);
      if (trial_.members.size() != before && !settle(rays, trial_)) return;
    }
  }
  trial_.could_see = missing_views_;
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    trial_.could_see += rays.could_see(view, trial_.at.point) ? 1 : 0;
  }
  if (trial_.members.size() >= needed(trial_)) remember(trial_);
}

// Makes the trial of two rays, if they meet where a marker can be.
bool NewMatcher::start(const RayTable& rays, Member a, Member b) {
  work_ += 2 * kWorkOfShadow;
  const double cos_angle = rays[a.view].direction(a.ray).dot(rays[b.view].direction(b.ray));
  if (std::abs(cos_angle) > max_cos_angle_) return false;
  trial_.members.clear();
  trial_.members.push_back(a);
  trial_.members.push_back(b);
  return settle(rays, trial_);
}

// Adds the nearest free ray of each view that has none in the hypothesis.
void NewMatcher::gather_support(const RayTable& rays, Hypothesis& from) {
  std::uint64_t has = 0;
  for (const Member& member : from.members) has |= std::uint64_t{1} << member.view;
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    if ((has >> view & 1) != 0 || rays[view].size() == 0) continue;
    work_ += kWorkOfShadow;
    const auto shadow = rays[view].shadow(from.at.point.v, from.at.covariance_m2);
    if (!shadow) continue;
    const auto nearest = rays[view].nearest_free(*shadow, settings_.agree_sigmas, settings_.calibration_px);
    if (!nearest) continue;
    from.members.push_back({static_cast<std::uint16_t>(view), static_cast<std::uint16_t>(*nearest)});
  }
}

// Finds the point of the members, leaves out those that do not agree; false where nothing is left to believe.
bool NewMatcher::settle(const RayTable& rays, Hypothesis& hypothesis) {
  sightings_.clear();
  for (const auto& [view, ray] : hypothesis.members) {
    geometry::Sighting sighting = rays[view].sighting(ray, static_cast<std::uint32_t>(view) << 16 | ray);
    // The covariance of a point is used to look for more views: it must hold the error of the rig too.
    sighting.sigma_px = std::hypot(sighting.sigma_px, settings_.calibration_px);
    sightings_.push_back(sighting);
  }
  work_ += sightings_.size() * kWorkOfShadow;
  const auto agreed = geometry::agree(sightings_, {0.0, settings_.agree_sigmas});
  if (!agreed) return false;
  const auto& at = agreed->refined.point.v.array();
  if ((at < settings_.volume_min_m.array()).any() || (at > settings_.volume_max_m.array()).any()) return false;
  hypothesis.at = agreed->refined;
  hypothesis.members.clear();
  for (std::size_t i = 0; i < agreed->kept; ++i) {
    const std::uint32_t source = sightings_[i].source;
    hypothesis.members.push_back(
        {static_cast<std::uint16_t>(source >> 16), static_cast<std::uint16_t>(source & 0xFFFF)});
  }
  return true;
}

std::uint32_t NewMatcher::needed(const Hypothesis& hypothesis) const {
  return std::max(2U, std::min(settings_.min_views_new, hypothesis.could_see));
}

bool NewMatcher::is_better(std::size_t a, std::size_t b) const {
  const std::size_t views_a = hypotheses_[a].members.size();
  const std::size_t views_b = hypotheses_[b].members.size();
  if (views_a != views_b) return views_a > views_b;
  const double rms_a = hypotheses_[a].at.rms_px;
  const double rms_b = hypotheses_[b].at.rms_px;
  return rms_a < rms_b || (rms_a == rms_b && a < b);
}

void NewMatcher::remember(const Hypothesis& hypothesis) {
  const auto index = static_cast<std::uint32_t>(hypotheses_.size());
  hypotheses_.push_back(hypothesis);
  undecided_.push_back(index);
  for (const Member& member : hypothesis.members) {
    std::uint32_t& best = best_of(member);
    if (best == kNone || is_better(index, best)) best = index;
  }
}

// Its rays may be asked about again.
void NewMatcher::forget(std::uint32_t index) {
  for (const Member& member : hypotheses_[index].members) {
    if (best_of(member) == index) best_of(member) = kNone;
  }
}

// Believes the hypotheses best first, each without the rays that better ones took.
void NewMatcher::decide(RayTable& rays, bool last_round, Matches& into) {
  const auto worse = [this](std::uint32_t a, std::uint32_t b) { return is_better(b, a); };
  open_.assign(undecided_.begin(), undecided_.end());
  undecided_.clear();
  std::ranges::make_heap(open_, worse);
  while (!open_.empty()) {
    std::ranges::pop_heap(open_, worse);
    const std::uint32_t index = open_.back();
    open_.pop_back();
    Hypothesis& best = hypotheses_[index];
    const std::size_t before = best.members.size();
    if (!lose_taken(rays, best)) {
      forget(index);
      continue;
    }
    const bool nearly_all =
        best.members.size() > settings_.min_views_new && 4 * best.members.size() >= 3 * best.could_see;
    if (best.members.size() != before) {
      open_.push_back(index);
      std::ranges::push_heap(open_, worse);
    } else if (best.members.size() == 2 || !(last_round || nearly_all)) {
      undecided_.push_back(index);
    } else {
      believe(rays, best, into);
    }
  }
}

// False when too little is left of the hypothesis.
bool NewMatcher::lose_taken(const RayTable& rays, Hypothesis& hypothesis) {
  const std::size_t before = hypothesis.members.size();
  for (std::size_t i = hypothesis.members.size(); i-- > 0;) {
    const auto [view, ray] = hypothesis.members[i];
    if (rays[view].taken[ray] != 0) hypothesis.members.erase_unordered(i);
  }
  if (hypothesis.members.size() == before) return true;
  return hypothesis.members.size() >= needed(hypothesis) && settle(rays, hypothesis) &&
         hypothesis.members.size() >= needed(hypothesis);
}

void NewMatcher::believe(RayTable& rays, const Hypothesis& hypothesis, Matches& into) {
  Match match;
  for (const auto& [view, ray] : hypothesis.members) {
    rays[view].taken[ray] = 1;
    match.sightings.push_back({view, rays[view].blob[ray], 0.0F, 0.0F, static_cast<float>(rays[view].sigma_px[ray])});
  }
  std::ranges::sort(match.sightings, {}, &BlobRef::view);
  if (!into.matches.try_push_back(match)) ++into.dropped;
}

// Two rays meet by chance easily: believed where neither fits any other.
void NewMatcher::believe_lone_pairs(RayTable& rays, Matches& into) {
  for (const std::uint32_t index : undecided_) {
    for (const auto& [view, ray] : hypotheses_[index].members) ++rivals_[view * kMaxBlobs + ray];
  }
  for (const std::uint32_t index : undecided_) {
    const Hypothesis& pair = hypotheses_[index];
    const bool alone =
        std::ranges::all_of(pair.members, [this](const Member& m) { return rivals_[m.view * kMaxBlobs + m.ray] == 1; });
    if (alone) believe(rays, pair, into);
  }
}

}  // namespace mocap::stages
