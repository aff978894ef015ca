// The part of SubjectLabeller that reads a stray track near the body anew.

#include <algorithm>

#include "stages/label_subject.h"

namespace mocap::stages {
namespace {

// How near a neighbour is whose name may be meant, how long a track must have been there to be read anew, and what half
// a sum of squared sigmas a further name is worth.
constexpr double kNeighbour_m = 0.14;
constexpr std::uint32_t kLeastAge = 3;
constexpr double kWorthAName = 12.0;

}  // namespace

// What a track that nobody bears could be, where a name that is free might be it or might be what a neighbour bears.
void SubjectLabeller::gather_readings(int track, const NamedTracks& tracks) {
  readings_.clear();
  const Eigen::Vector3d& at = (*tracks.tracked)[static_cast<std::size_t>(track)].position.v;
  for (std::size_t f = 0; f < names_.size(); ++f) {
    if (names_[f].index >= 0 || !places_[f].known) continue;
    const auto may_be = [&](const Eigen::Vector3d& there) {
      return (there - places_[f].at).norm() < settings_.most_gate_m && tied(f, there, tracks);
    };
    if (readings_.size() < kMostReadings && may_be(at)) readings_.push_back({f, f, track, 0.0});
    for (const body::Observation& one : seen_) {
      const auto g = static_cast<std::size_t>(one.marker);
      const bool near = (one.position - at).norm() < kNeighbour_m;
      if (readings_.size() < kMostReadings && near && may_be(one.position)) readings_.push_back({f, g, track, 0.0});
    }
  }
}

// Whether the body can be so, and what it costs.
bool SubjectLabeller::judge_reading(Reading& reading, const NamedTracks& tracks) {
  const TrackedMarker& track = (*tracks.tracked)[static_cast<std::size_t>(reading.track)];
  tried_.clear();
  body::Observation free{static_cast<int>(reading.name), track.position.v, kMarkerSigma_m};
  for (const body::Observation& one : seen_) {
    tried_.push_back(one);
    if (static_cast<std::size_t>(one.marker) != reading.giver) continue;
    tried_.back().position = track.position.v;
    free.position = one.position;
  }
  tried_.push_back(free);
  reading.cost = body_.explain(tried_).cost;
  const double most = most_off();
  return std::all_of(tried_.begin(), tried_.end(), [&](const body::Observation& one) {
    const auto m = static_cast<std::size_t>(one.marker);
    if (m != reading.name && m != reading.giver) return true;
    return (one.position - body_.pose().marker_at(m)).norm() < most;
  });
}

void SubjectLabeller::adopt(const Reading& reading, NamedTracks& tracks) {
  int track = reading.track;
  if (reading.giver != reading.name) {
    track = names_[reading.giver].index;
    free(reading.giver, tracks);
    give(reading.giver, reading.track, kFreshConfidence, tracks);
  }
  give(reading.name, track, kFreshConfidence, tracks);
  believed_[reading.name] = true;
  for (body::Observation& one : seen_) {
    if (static_cast<std::size_t>(one.marker) == reading.giver) one = observe(reading.giver, tracks);
  }
  seen_.push_back(observe(reading.name, tracks));
  (void)body_.fit(seen_);
}

// A track near the body that nobody bears, while a name is free: the name was lost on the way, or a neighbour bears
// the wrong one. One track a set, for a reading costs as much as a pose.
void SubjectLabeller::reconsider(NamedTracks& tracks) {
  const std::size_t count = tracks.named.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t t = (turn_ + i) % count;
    const TrackedMarker& track = (*tracks.tracked)[t];
    const bool there = track.state == TrackState::Confirmed && track.age_sets >= kLeastAge;
    if (tracks.named[t] || !there || !track.position.v.allFinite()) continue;
    gather_readings(static_cast<int>(t), tracks);
    if (readings_.empty()) continue;
    turn_ = t + 1;
    const double now = body_.explain(seen_).cost;
    const Reading* best = nullptr;
    double next = now + kWorthAName;
    for (Reading& reading : readings_) {
      if (!judge_reading(reading, tracks)) continue;
      if (best == nullptr || reading.cost < best->cost) {
        if (best != nullptr) next = std::min(next, best->cost);
        best = &reading;
      } else {
        next = std::min(next, reading.cost);
      }
    }
    (void)body_.fit(seen_);
    if (best != nullptr && best->cost + kClearMargin < next) adopt(*best, tracks);
    return;
  }
}

}  // namespace mocap::stages
