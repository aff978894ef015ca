// Which of the hypotheses of new markers are believed, and in what order: the second half of `NewMatcher`.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include "associate/unassigned/unassigned_matcher.h"

namespace mocap::associate {

std::uint32_t NewMatcher::needed(const Hypothesis& hypothesis) const {
  return std::max(2U, std::min(settings_.min_views_new, hypothesis.could_see));
}

bool NewMatcher::is_better(std::size_t a, std::size_t b) const {
  const std::size_t views_a = hypotheses_[a].members.size();
  const std::size_t views_b = hypotheses_[b].members.size();
  if (views_a != views_b) return views_a > views_b;
  return std::pair(hypotheses_[a].at.rms_px, a) < std::pair(hypotheses_[b].at.rms_px, b);
}

void NewMatcher::remember(const Hypothesis& hypothesis) {
  const auto index = static_cast<std::uint32_t>(hypotheses_.size());
  hypotheses_.push_back(hypothesis);
  undecided_.push_back(index);
  for (const Member& member : hypothesis.members) {
    std::uint32_t& best = best_of_[slot(member)];
    if (best == kNone || is_better(index, best)) best = index;
  }
}

// Its rays may be asked about again.
void NewMatcher::forget(std::uint32_t index) {
  for (const Member& member : hypotheses_[index].members) {
    if (best_of_[slot(member)] == index) best_of_[slot(member)] = kNone;
  }
}

// Believes the hypotheses best first, each without the rays that better ones took.
void NewMatcher::decide(RayTable& rays, bool last_round, Matches& into) {
  const std::size_t before_matches = into.matches.size() + into.dropped;
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
  if (into.matches.size() + into.dropped != before_matches) gather_free(rays);
}

// False when too little is left of the hypothesis.
bool NewMatcher::lose_taken(RayTable& rays, Hypothesis& hypothesis) {
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
  std::array<std::uint16_t, kMaxCameras> ray_of;  // only of those in `views`
  std::uint64_t views = 0;
  for (const auto& [view, ray] : hypothesis.members) {
    rays[view].take(ray);
    ray_of[view] = ray;
    views |= std::uint64_t{1} << view;
  }
  if (into.matches.full()) {
    ++into.dropped;
    return;
  }
  Match& match = into.matches.push_back(none_);
  const geometry::Refined& at = hypothesis.at;
  match.meeting = {at.point, at.covariance_m2, at.rms_px, agreement_.floor_px, agreement_.sigmas};
  for (; views != 0; views &= views - 1) {  // in their order
    const auto view = static_cast<std::uint16_t>(std::countr_zero(views));
    const std::uint16_t ray = ray_of[view];
    match.sightings.push_back({view, rays[view].blob[ray], 0.0F, 0.0F, rays[view].sigma_f[ray]});
  }
}

// Two rays meet by chance easily: believed where neither fits any other.
void NewMatcher::believe_lone_pairs(RayTable& rays, Matches& into) {
  for (const std::uint32_t index : undecided_) {
    for (const auto& [view, ray] : hypotheses_[index].members) ++rivals_[slot({view, ray})];
  }
  for (const std::uint32_t index : undecided_) {
    const Hypothesis& pair = hypotheses_[index];
    const bool alone = std::ranges::all_of(pair.members, [this](const Member& m) { return rivals_[slot(m)] == 1; });
    if (alone) believe(rays, pair, into);
  }
}

}  // namespace mocap::associate
