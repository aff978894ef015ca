#include "lib/scoring/truth.h"

#include <fmt/core.h>

#include <algorithm>

namespace mocap::scoring {
namespace {

NamedMarker between(const NamedMarker& a, const NamedMarker& b, double share) {
  NamedMarker mixed = a;
  mixed.position_m = a.position_m + share * (b.position_m - a.position_m);
  return mixed;
}

PosedBone between(const PosedBone& a, const PosedBone& b, double share) {
  PosedBone mixed = a;
  mixed.position_m = a.position_m + share * (b.position_m - a.position_m);
  mixed.rotation = a.rotation.slerp(share, b.rotation);
  return mixed;
}

std::pair<std::uint32_t, std::uint32_t> label_of(const NamedMarker& m) { return {m.subject, m.marker}; }
std::pair<std::uint32_t, std::uint32_t> label_of(const PosedBone& b) { return {b.subject, b.bone}; }

// Both lists are sorted by label.
template <class Thing>
std::vector<Thing> between(const std::vector<Thing>& a, const std::vector<Thing>& b, double share) {
  std::vector<Thing> mixed;
  auto other = b.begin();
  for (const Thing& thing : a) {
    while (other != b.end() && label_of(*other) < label_of(thing)) ++other;
    if (other == b.end()) break;
    if (label_of(*other) == label_of(thing)) mixed.push_back(between(thing, *other, share));
  }
  return mixed;
}

Duration median_step(const std::vector<EvalFrame>& frames) {
  if (frames.size() < 2) return std::chrono::seconds(1);
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].exposed_at - frames[i - 1].exposed_at);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

Result<Truth> Truth::of(std::vector<EvalFrame> frames) {
  if (frames.empty()) return Error{ErrorCode::InvalidArgument, "the truth has no frames"};
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i].exposed_at <= frames[i - 1].exposed_at) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("the truth's frame {} (number {}) is not later than the one before it", i + 1, frames[i].number)};
    }
  }
  const Duration period = median_step(frames);
  return Truth(std::move(frames), period);
}

std::optional<EvalFrame> Truth::at(Timestamp when) const {
  const auto after = std::lower_bound(frames_.begin(), frames_.end(), when,
                                      [](const EvalFrame& f, Timestamp t) { return f.exposed_at < t; });
  const bool has_after = after != frames_.end();
  if (has_after && after->exposed_at == when) return *after;
  const bool has_before = after != frames_.begin();
  if (has_before && has_after && after->exposed_at - (after - 1)->exposed_at < period_ * 3 / 2) {
    const EvalFrame& before = *(after - 1);
    const double share = to_s(when - before.exposed_at) / to_s(after->exposed_at - before.exposed_at);
    EvalFrame mixed;
    mixed.number = before.number;
    mixed.exposed_at = when;
    mixed.markers = between(before.markers, after->markers, share);
    mixed.bones = between(before.bones, after->bones, share);
    mixed.subjects = before.subjects;
    return mixed;
  }
  if (has_before && when - (after - 1)->exposed_at <= period_ / 2) return *(after - 1);
  if (has_after && after->exposed_at - when <= period_ / 2) return *after;
  return std::nullopt;
}

}  // namespace mocap::scoring
