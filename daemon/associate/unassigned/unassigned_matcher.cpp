#include "associate/unassigned/unassigned_matcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "base/loops.h"
#include "geometry/epipolar.h"

namespace mocap::associate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Bound on the memory for one set.
constexpr std::size_t kMaxHypotheses = 4096;
// Bound on the work for one set, in units of about a nanosecond: 4 ms.
constexpr std::size_t kMaxWork = 4'000'000;
constexpr std::size_t kProjectionWork = 40;
// Rounds in one set: all rounds of up to 16 cameras. With more cameras, each set covers the first, most suitable rounds
// and some of the others in turn. See decisions/0003.
constexpr std::size_t kMaxRoundsPerSet = 16;
constexpr std::size_t kFixedRounds = 4;
// With at most kMaxRaysForBatch rays in one view and at least kMinLinesForBatch in the other, all epipolar lines are
// tested in one batch first, because few rays lie near a line by chance. Chosen by hand; not yet measured.
constexpr std::size_t kMaxRaysForBatch = 16;
constexpr std::size_t kMinLinesForBatch = 4;

}  // namespace

UnassignedMatcher::UnassignedMatcher(const MatchSettings& settings, const Rig& rig, RigError& error)
    : settings_(settings),
      error_(error),
      agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
      rounds_(rig),
      max_cos_angle_(std::cos(settings.min_ray_angle_deg * std::numbers::pi / 180.0)),
      best_of_(rig.size() * kMaxBlobs, kNone),
      competitor_count_(rig.size() * kMaxBlobs, 0),
      deferred_(rig.size() * kMaxBlobs, 0),
      unassigned_(rig.size()),
      distance_(kMaxBlobs),
      line_excess_(kMaxBlobs) {
  for (auto& column : epipolar_lines_) column.resize(kMaxBlobs);
  line_candidates_.reserve(kMaxBlobs);
  hypotheses_.reserve(kMaxHypotheses);
  decision_queue_.reserve(kMaxHypotheses);
  undecided_.reserve(kMaxHypotheses);
  candidates_.reserve(kMaxHypotheses);
}

void UnassignedMatcher::match(RayTable& rays, std::uint32_t missing_views, Matches& into) {
  missing_views_ = missing_views;
  const auto cameras = static_cast<std::uint32_t>(rays.view_count()) + missing_views;
  required_views_ = std::clamp(cameras, 2U, settings_.min_views_new);
  rig_px_ = error_.px();
  agreement_.floor_px = settings_.agree_sigmas * rig_px_;
  work_ = 0;
  skipped_ = 0;
  retrying_ = false;
  hypotheses_.clear();
  undecided_.clear();
  candidates_.clear();
  gather_unassigned(rays);
  if (views_with_unassigned_ < 2) return;
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    // If all rays are unassigned, all quadrics are needed, and computing them together is faster.
    if (unassigned_[view].count == rays[view].size()) rays[view].make_all_quadrics();
    const auto first = static_cast<std::ptrdiff_t>(view * kMaxBlobs);
    std::fill_n(best_of_.begin() + first, rays[view].size(), kNone);
    std::fill_n(competitor_count_.begin() + first, rays[view].size(), 0U);
    std::fill_n(deferred_.begin() + first, rays[view].size(), std::uint8_t{0});
  }

  const bool few = rounds_.size() <= kMaxRoundsPerSet;
  for (std::size_t round_count = 0; round_count < std::min(rounds_.size(), kMaxRoundsPerSet); ++round_count) {
    if (round_count > 0) accept_hypotheses(rays, false, into);
    if (views_with_unassigned_ < 2) break;
    if (few || round_count < kFixedRounds) {
      match_round(rays, round_count);
    } else {
      match_round(rays, kFixedRounds + next_round_);
      next_round_ = (next_round_ + 1) % (rounds_.size() - kFixedRounds);
    }
  }
  accept_hypotheses(rays, true, into);
  retry_deferred(rays, into);
  accept_isolated_pairs(rays, into);
  append_candidates(rays, into);
  into.skipped += skipped_;
}

void UnassignedMatcher::archive(Archive& members) {
  members(next_round_);
  if (next_round_ > 0 && kFixedRounds + next_round_ >= rounds_.size()) members.fail();
}

void UnassignedMatcher::match_round(RayTable& rays, std::size_t round) {
  for (const CameraPair& pair : rounds_.round(round)) match_pair(rays, pair);
}

void UnassignedMatcher::gather_unassigned(const RayTable& rays) {
  views_with_unassigned_ = 0;
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    const ViewRays& from = rays[view];
    UnassignedRays& unassigned = unassigned_[view];
    unassigned.eye = from.camera->centre().v;
    unassigned.focal_px = from.focal_px;
    const Matrix3d world_from_camera = from.camera->camera_from_world.rotation.transpose();
    unassigned.count = 0;
    from.for_each_unassigned([&](std::size_t ray) {
      unassigned.ray[unassigned.count] = static_cast<std::uint16_t>(ray);
      unassigned.x[unassigned.count] = from.x_f[ray];
      unassigned.y[unassigned.count] = from.y_f[ray];
      unassigned.sigma_px[unassigned.count] = from.sigma_f[ray];
      unassigned.direction[unassigned.count++] = world_from_camera * Vector3d(from.x(ray), from.y(ray), 1.0);
    });
    views_with_unassigned_ += unassigned.count == 0 ? 0 : 1;
  }
}

void UnassignedMatcher::match_pair(RayTable& rays, const CameraPair& pair) {
  const auto a = rays.view_of(pair.a);
  const auto b = rays.view_of(pair.b);
  if (!a || !b || unassigned_[*b].count == 0) return;
  const bool at_once = unassigned_[*b].count <= kMaxRaysForBatch && unassigned_[*a].count >= kMinLinesForBatch;
  bool measured = false;
  for (std::size_t i = 0; i < unassigned_[*a].count; ++i) {
    if (work_ > kMaxWork) {
      ++skipped_;
      continue;
    }
    if (!retrying_ && defer({static_cast<std::uint16_t>(*a), unassigned_[*a].ray[i]})) continue;
    if (at_once && !measured) measure_line_excess(unassigned_[*a], unassigned_[*b], pair);
    measured = true;
    if (at_once && line_excess_[i] > 0.0F) continue;
    match_ray(rays, pair, *a, i, *b);
  }
}

// The gate around an epipolar line, from the errors of both blobs and of the rig.
double UnassignedMatcher::epipolar_gate_px(double sigma_px) const {
  return std::sqrt(rig_px_ * rig_px_ + sigma_px * sigma_px) * 2.0 * settings_.agree_sigmas;
}

// For each ray of a: the distance of the nearest ray of b from its epipolar line, less the gate. Rounded down, so that
// no ray in the gate is missed.
MOCAP_WIDE void UnassignedMatcher::measure_line_excess(const UnassignedRays& of_a, const UnassignedRays& of_b,
                                                       const CameraPair& pair) {
  constexpr float kRounding = 1e-5F;  // relative to the baseline and to the gate
  const Eigen::Matrix3f e = pair.essential.cast<float>();
  const float xx = e(0, 0), xy = e(0, 1), x1 = e(0, 2), yx = e(1, 0), yy = e(1, 1), y1 = e(1, 2);
  const float zx = e(2, 0), zy = e(2, 1), z1 = e(2, 2), rounding = kRounding * e.norm();
  const auto rig_px2 = static_cast<float>(rig_px_ * rig_px_);
  const double allowed_sigmas = 2.0 * settings_.agree_sigmas / std::min(of_a.focal_px, of_b.focal_px);
  const float allowed = (1.0F + kRounding) * static_cast<float>(allowed_sigmas);
  const float *ax = of_a.x.data(), *ay = of_a.y.data(), *sigma_px = of_a.sigma_px.data();
  float *lx = epipolar_lines_[0].data(), *ly = epipolar_lines_[1].data(), *l1 = epipolar_lines_[2].data(),
        *beyond = line_excess_.data();
  const std::size_t count = of_a.count;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    lx[i] = xx * ax[i] + xy * ay[i] + x1;
    ly[i] = yx * ax[i] + yy * ay[i] + y1;
    l1[i] = zx * ax[i] + zy * ay[i] + z1;
    beyond[i] = std::numeric_limits<float>::max();
  }
  for (std::size_t j = 0; j < of_b.count; ++j) {
    const float x = of_b.x[j], y = of_b.y[j];
    MOCAP_INDEPENDENT_TURNS
    for (std::size_t i = 0; i < count; ++i) {
      const float distance = std::abs(lx[i] * x + ly[i] * y + l1[i]);
      beyond[i] = distance < beyond[i] ? distance : beyond[i];
    }
  }
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    const float off_px2 = rig_px2 + sigma_px[i] * sigma_px[i], slope2 = lx[i] * lx[i] + ly[i] * ly[i];
    beyond[i] -= allowed * std::sqrt(off_px2 * slope2) + rounding;
  }
}

// Pairs a ray of a with the rays of b near its epipolar line, the nearest first.
void UnassignedMatcher::match_ray(RayTable& rays, const CameraPair& pair, std::size_t a, std::size_t i, std::size_t b) {
  const HypothesisRay of_a{static_cast<std::uint16_t>(a), unassigned_[a].ray[i]};
  const auto line = geometry::epipolar_line(pair.essential, {{rays[a].x(of_a.ray), rays[a].y(of_a.ray)}});
  if (line.n.isZero()) return;  // the ray passes through the other camera: no epipolar line
  work_ += unassigned_[b].count;
  find_line_candidates(unassigned_[b], line.n,
                       epipolar_gate_px(rays[a].sigma_px[of_a.ray]) / std::min(rays[a].focal_px, rays[b].focal_px));
  for (const auto& [distance, j] : line_candidates_) {
    const HypothesisRay of_b{static_cast<std::uint16_t>(b), unassigned_[b].ray[j]};
    if (is_explained(of_a, of_b)) continue;
    if (retrying_ ? deferred_[slot(of_a)] == 0 && deferred_[slot(of_b)] == 0 : defer(of_b)) continue;
    try_pair(rays, a, i, b, j);
    if (!retrying_ && defer(of_a)) return;
  }
}

// The distance of each unassigned ray from the line.
MOCAP_WIDE void UnassignedMatcher::measure_line_distances(const UnassignedRays& of_b, const Vector3d& line) {
  const float* const x = of_b.x.data();
  const float* const y = of_b.y.data();
  float* const distance = distance_.data();
  const auto nx = static_cast<float>(line.x());
  const auto ny = static_cast<float>(line.y());
  const auto nz = static_cast<float>(line.z());
  const std::size_t count = of_b.count;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t j = 0; j < count; ++j) distance[j] = std::abs(nx * x[j] + ny * y[j] + nz);
}

void UnassignedMatcher::find_line_candidates(const UnassignedRays& of_b, const Vector3d& line, double allowed) {
  measure_line_distances(of_b, line);
  const auto limit = static_cast<float>(allowed);
  line_candidates_.clear();
  for (std::uint32_t j = 0; j < of_b.count; ++j) {
    if (distance_[j] <= limit) line_candidates_.push_back({distance_[j], j});
  }
  std::ranges::sort(line_candidates_, [](const LineCandidate& a, const LineCandidate& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
  });
}

// Pairs again the rays that were deferred for a well supported hypothesis but are still unassigned.
void UnassignedMatcher::retry_deferred(RayTable& rays, Matches& into) {
  bool any = false;
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    for (const std::uint16_t ray : unassigned_[view].rays()) any = any || deferred_[view * kMaxBlobs + ray] != 0;
  }
  if (!any) return;
  retrying_ = true;
  for (const CameraPair& pair : rounds_.all()) match_pair(rays, pair);
  accept_hypotheses(rays, true, into);
}

// Whether both rays have the same best hypothesis: pairing them again would give the same hypothesis.
bool UnassignedMatcher::is_explained(HypothesisRay a, HypothesisRay b) const {
  return best_of_[slot(a)] != kNone && best_of_[slot(a)] == best_of_[slot(b)];
}

// Marks a ray that belongs to a well supported hypothesis as deferred: the ray is not paired before retry_deferred().
// Returns whether the ray was deferred.
bool UnassignedMatcher::defer(HypothesisRay member) {
  const std::uint32_t best = best_of_[slot(member)];
  if (best == kNone || !hypotheses_[best].is_well_supported) return false;
  deferred_[slot(member)] = 1;
  return true;
}

void UnassignedMatcher::try_pair(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j) {
  if (work_ > kMaxWork || hypotheses_.size() == kMaxHypotheses) {
    ++skipped_;
    return;
  }
  if (!triangulate_pair(rays, a, i, b, j)) return;
  gather_support(rays, trial_);
  if (trial_.members.size() > 2) {
    if (!refine(rays, trial_)) return;
    // The refined point may find views that were missed and separates near blobs.
    if (trial_.members.size() < rays.view_count()) {
      const std::size_t before = trial_.members.size();
      gather_support(rays, trial_);
      if (trial_.members.size() != before && !refine(rays, trial_)) return;
    }
  }
  if (trial_.members.size() >= required_views_) {
    count_observing_cameras(rays, trial_);
    store(trial_);
  } else if (!retrying_ && candidates_.size() < kMaxHypotheses && may_be_candidate(rays, trial_)) {
    candidates_.push_back(trial_);
  }
}

// Makes the trial hypothesis of two rays. Returns false if the rays do not meet inside the volume.
bool UnassignedMatcher::triangulate_pair(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j) {
  work_ += kProjectionWork;
  const Vector3d& along_a = unassigned_[a].direction[i];
  const Vector3d& along_b = unassigned_[b].direction[j];
  const Vector3d between = unassigned_[b].eye - unassigned_[a].eye;
  const double aa = along_a.squaredNorm();
  const double ab = along_a.dot(along_b);
  const double bb = along_b.squaredNorm();
  if (ab * ab > max_cos_angle_ * max_cos_angle_ * aa * bb) return false;
  // The points of closest approach; the parameters are depths.
  const double inverse = 1.0 / (aa * bb - ab * ab);
  const double depth_a = (along_a.dot(between) * bb - along_b.dot(between) * ab) * inverse;
  const double depth_b = (along_a.dot(between) * ab - along_b.dot(between) * aa) * inverse;
  if (!(depth_a > 0.0 && depth_b > 0.0)) return false;
  const Vector3d middle = 0.5 * (unassigned_[a].eye + depth_a * along_a + unassigned_[b].eye + depth_b * along_b);
  if (!settings_.in_volume(middle)) return false;
  trial_.at.point = {middle};
  trial_.members.clear();
  trial_.members.push_back({static_cast<std::uint16_t>(a), unassigned_[a].ray[i]});
  trial_.members.push_back({static_cast<std::uint16_t>(b), unassigned_[b].ray[j]});
  return refine(rays, trial_);
}

// Adds the nearest unassigned ray of each other view. The rig error increases the covariance of the point.
void UnassignedMatcher::gather_support(RayTable& rays, Hypothesis& from) {
  std::uint64_t has = 0;
  double sum_1_px2 = 0.0;
  for (const auto& [view, ray] : from.members) {
    has |= std::uint64_t{1} << view;
    sum_1_px2 += 1.0 / (rays[view].sigma_px[ray] * rays[view].sigma_px[ray]);
  }
  const double times = 1.0 + rig_px_ * rig_px_ * sum_1_px2 / static_cast<double>(from.members.size());
  work_ += (rays.view_count() - from.members.size()) * kProjectionWork / 4;
  rays.project_gaussian(from.at.point.v, times * from.at.covariance_m2, settings_.agree_sigmas, rig_px_);
  for (std::size_t view = 0; view < rays.view_count(); ++view) {
    if ((has >> view & 1) != 0 || unassigned_[view].count == 0) continue;
    const auto nearest = rays.nearest_unassigned(view);
    if (!nearest) continue;
    from.members.push_back({static_cast<std::uint16_t>(view), static_cast<std::uint16_t>(*nearest)});
  }
}

// Computes the point of the members and removes outliers. Returns false if no point inside the volume is left.
bool UnassignedMatcher::refine(RayTable& rays, Hypothesis& hypothesis) {
  sightings_.clear();
  for (const auto& [view, ray] : hypothesis.members) {
    rays[view].make_quadric(ray);
    sightings_.push_back(rays[view].sighting(ray, static_cast<std::uint32_t>(view) << 16 | ray));
  }
  work_ += sightings_.size() * kProjectionWork / 4;
  const auto agreed = geometry::agree(sightings_, hypothesis.at.point, agreement_);
  if (!agreed || !settings_.in_volume(agreed->refined.point.v)) return false;
  hypothesis.at = agreed->refined;
  if (agreed->kept == hypothesis.members.size()) return true;
  hypothesis.members.clear();
  for (std::size_t i = 0; i < agreed->kept; ++i) {
    const std::uint32_t source = sightings_[i].source;
    hypothesis.members.push_back(
        {static_cast<std::uint16_t>(source >> 16), static_cast<std::uint16_t>(source & 0xFFFF)});
  }
  return true;
}

// Counts the cameras that could see the point; a hypothesis with most views of the set needs no count.
void UnassignedMatcher::count_observing_cameras(const RayTable& rays, Hypothesis& hypothesis) const {
  const std::size_t views = hypothesis.members.size();
  const std::size_t most = rays.view_count() + missing_views_;
  hypothesis.observing_cameras = static_cast<std::uint32_t>(most);
  if (4 * views < 3 * most) {
    hypothesis.observing_cameras = missing_views_;
    for (std::size_t view = 0; view < rays.view_count(); ++view) {
      hypothesis.observing_cameras += rays.is_in_image(view, hypothesis.at.point) ? 1 : 0;
    }
  }
  hypothesis.is_well_supported = views > settings_.min_views_new && 2 * views >= hypothesis.observing_cameras;
}

}  // namespace mocap::associate
