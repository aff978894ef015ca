// The second half of UnassignedMatcher: selects the hypotheses of new markers that become matches.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include "associate/unassigned/unassigned_matcher.h"

namespace mocap::associate {

bool UnassignedMatcher::is_better(std::size_t a, std::size_t b) const {
  const std::size_t views_a = hypotheses_[a].members.size();
  const std::size_t views_b = hypotheses_[b].members.size();
  if (views_a != views_b) return views_a > views_b;
  return std::pair(hypotheses_[a].at.rms_px, a) < std::pair(hypotheses_[b].at.rms_px, b);
}

void UnassignedMatcher::store(const Hypothesis& hypothesis) {
  const auto index = static_cast<std::uint32_t>(hypotheses_.size());
  hypotheses_.push_back(hypothesis);
  undecided_.push_back(index);
  for (const HypothesisRay& member : hypothesis.members) {
    std::uint32_t& best = best_of_[slot(member)];
    if (best == kNone || is_better(index, best)) best = index;
  }
}

// Removes a hypothesis. Its rays are available to other hypotheses again.
void UnassignedMatcher::discard(std::uint32_t index) {
  for (const HypothesisRay& member : hypotheses_[index].members) {
    if (best_of_[slot(member)] == index) best_of_[slot(member)] = kNone;
  }
}

// Accepts hypotheses greedily, best first. A hypothesis loses the rays that better hypotheses use and is ranked again.
void UnassignedMatcher::accept_hypotheses(RayTable& rays, bool last_round, Matches& into) {
  const std::size_t before_matches = into.matches.size() + into.dropped;
  const auto worse = [this](std::uint32_t a, std::uint32_t b) { return is_better(b, a); };
  decision_queue_.assign(undecided_.begin(), undecided_.end());
  undecided_.clear();
  std::ranges::make_heap(decision_queue_, worse);
  while (!decision_queue_.empty()) {
    std::ranges::pop_heap(decision_queue_, worse);
    const std::uint32_t index = decision_queue_.back();
    decision_queue_.pop_back();
    Hypothesis& best = hypotheses_[index];
    const std::size_t before = best.members.size();
    if (!remove_used_rays(rays, best)) {
      discard(index);
      continue;
    }
    const bool nearly_all =
        best.members.size() > settings_.min_views_new && 4 * best.members.size() >= 3 * best.observing_cameras;
    if (best.members.size() != before) {
      decision_queue_.push_back(index);
      std::ranges::push_heap(decision_queue_, worse);
    } else if (best.members.size() == 2 || !(last_round || nearly_all)) {
      undecided_.push_back(index);
    } else {
      accept(rays, best, into);
    }
  }
  if (into.matches.size() + into.dropped != before_matches) gather_unassigned(rays);
}

// Removes the rays that belong to a match from a hypothesis. Returns false if too few views are left.
bool UnassignedMatcher::remove_used_rays(RayTable& rays, Hypothesis& hypothesis) {
  const std::size_t before = hypothesis.members.size();
  for (std::size_t i = hypothesis.members.size(); i-- > 0;) {
    const auto [view, ray] = hypothesis.members[i];
    if (rays[view].use_count[ray] != 0) hypothesis.members.erase_unordered(i);
  }
  if (hypothesis.members.size() == before) return true;
  return hypothesis.members.size() >= required_views_ && refine(rays, hypothesis) &&
         hypothesis.members.size() >= required_views_;
}

void UnassignedMatcher::accept(RayTable& rays, const Hypothesis& hypothesis, Matches& into) {
  std::array<std::uint16_t, kMaxCameras> ray_of;  // valid for the views in `views`
  std::uint64_t views = 0;
  for (const auto& [view, ray] : hypothesis.members) {
    rays[view].increment_use(ray);
    ray_of[view] = ray;
    views |= std::uint64_t{1} << view;
  }
  if (into.matches.full()) {
    ++into.dropped;
    return;
  }
  Match& match = into.matches.push_back(none_);
  const geometry::Refined& at = hypothesis.at;
  match.triangulation = {at.point, at.covariance_m2, at.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (; views != 0; views &= views - 1) {  // in the order of the views
    const auto view = static_cast<std::uint16_t>(std::countr_zero(views));
    const std::uint16_t ray = ray_of[view];
    match.sightings.push_back({view, rays[view].blob[ray], 0.0F, 0.0F, rays[view].sigma_f[ray]});
  }
}

// Accepts hypotheses of two views that share no ray with another hypothesis: two rays often meet by chance.
void UnassignedMatcher::accept_isolated_pairs(RayTable& rays, Matches& into) {
  for (const std::uint32_t index : undecided_) {
    for (const auto& [view, ray] : hypotheses_[index].members) ++competitor_count_[slot({view, ray})];
  }
  for (const std::uint32_t index : undecided_) {
    const Hypothesis& pair = hypotheses_[index];
    const bool alone =
        std::ranges::all_of(pair.members, [this](const HypothesisRay& m) { return competitor_count_[slot(m)] == 1; });
    if (alone) accept(rays, pair, into);
  }
}

// Whether a hypothesis with too few views for a match may be a marker that a body hides from the other cameras. A body
// hides a marker on its surface from about half of the cameras around it; if half of the cameras that could see the
// point are as many as a match needs, the marker is expected to be a match.
bool UnassignedMatcher::may_be_candidate(const RayTable& rays, const Hypothesis& hypothesis) const {
  const std::uint32_t enough = 2 * settings_.min_views_new;
  std::uint32_t observing = missing_views_;
  if (observing + rays.view_count() < enough) return true;
  for (std::size_t view = 0; view < rays.view_count() && observing < enough; ++view) {
    observing += rays.is_in_image(view, hypothesis.at.point) ? 1 : 0;
  }
  return observing < enough;
}

// Appends the hypotheses that are no match and whose rays are unassigned.
void UnassignedMatcher::append_candidates(const RayTable& rays, Matches& into) {
  for (const std::uint32_t index : undecided_) append_candidate(rays, hypotheses_[index], into);
  for (const Hypothesis& hypothesis : candidates_) append_candidate(rays, hypothesis, into);
}

void UnassignedMatcher::append_candidate(const RayTable& rays, const Hypothesis& hypothesis, Matches& into) const {
  double sum_1_px2 = 0.0;
  for (const auto& [view, ray] : hypothesis.members) {
    if (rays[view].use_count[ray] != 0) return;
    sum_1_px2 += 1.0 / (rays[view].sigma_px[ray] * rays[view].sigma_px[ray]);
  }
  const double times = 1.0 + rig_px_ * rig_px_ * sum_1_px2 / static_cast<double>(hypothesis.members.size());
  static_cast<void>(into.candidates.try_push_back({hypothesis.at.point, times * hypothesis.at.covariance_m2}));
}

}  // namespace mocap::associate
