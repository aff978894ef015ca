// The part of SubjectLabeller that has limbs read anew where names are missing while nameless tracks stand near.

#include <algorithm>
#include <cmath>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A name of another limb that is farther away does not want a track.
constexpr double kCompetingRadius_m = 0.3;
// In squared sigmas, as claims have it: a missing name of another limb wants a track that is as near as that to where
// it is thought to be; one whose place is hardly known, only what the limb's own marker is less likely to be.
constexpr double kCompetingCost = 15.0;
// Bounds what a set costs.
constexpr int kMaxLimbsPerSet = 2;
// A limb that is not clear is read again before that.
constexpr double kMarginalLifetime_s = 0.05;
// How far apart, rms of an axis, the markers may be that a track may be, for it to tell where its limb is.
constexpr double kMaxAmbiguitySigma_m = 0.1;

}  // namespace

// Below what cost another limb's missing name wants a track that this marker would have: of two limbs that are both
// lost the farther one waits for the nearer.
double SubjectLabeller::competing_cost(std::size_t marker, int index, const LabelledTracks& tracks) const {
  if (!places_[marker].known) return kCompetingCost;
  geometry::AllowedPair here;
  assignment_cost(marker, static_cast<std::size_t>(index), tracks, here);
  return std::isfinite(here.cost) ? std::max(kCompetingCost, here.cost) : kCompetingCost;
}

// Whether a missing name that is no part of the limb may well be this track, at a cost below that: two limbs that touch
// are told from each other by claims, or by their motion.
bool SubjectLabeller::has_competing_label(int index, double below, const LabelledTracks& tracks) const {
  if (!participates_) return false;
  const TrackedMarker& track = tracks[index];
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (accepted_[m] || !places_[m].known || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const Eigen::Vector3d off = track.position.v - places_[m].at;
    if (!(off.squaredNorm() < kCompetingRadius_m * kCompetingRadius_m)) continue;
    geometry::AllowedPair pair;
    assignment_cost(m, static_cast<std::size_t>(index), tracks, pair);
    if (pair.cost < below) return true;
  }
  return false;
}

// Where the limb's names are by what was found, in this set: of sets ago, its tracks may be lost, or have other names.
// False where the limb was named otherwise meanwhile.
bool SubjectLabeller::map_hypothesis(const DistanceConstraintMatcher::AssignmentHypothesis& found,
                                     const LabelledTracks& tracks) {
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    const int candidate = found.candidate_of[n];
    const TrackId id = candidate < 0 ? TrackId{} : limb_.candidate(static_cast<std::size_t>(candidate)).track;
    if (accepted_[m] && memories_[m].track != initial_tracks_[n] && memories_[m].track != id) return false;
    hypothesis_track_[n] = candidate < 0 ? LabelledTracks::kNone : tracks.find(id);
    if (hypothesis_track_[n] < 0) continue;
    const bool gone =
        tracks[hypothesis_track_[n]].state == TrackState::Coasting || is_assigned_elsewhere(hypothesis_track_[n]);
    const bool is_new_assignment = candidate != limb_.current(n);
    if (gone || (is_new_assignment &&
                 (has_competing_label(hypothesis_track_[n], competing_cost(m, hypothesis_track_[n], tracks), tracks) ||
                  is_ambiguous_elsewhere(id))))
      hypothesis_track_[n] = LabelledTracks::kNone;
  }
  return true;
}

// Whether the last reading of another limb left open only which of that limb's markers it is.
bool SubjectLabeller::is_ambiguous_elsewhere(TrackId track) const {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && memories_[m].index < 0 && memories_[m].ambiguous_track == track &&
        has_current_marginal(memories_[m]))
      return true;
  }
  return false;
}

// Whether a believed name that is no part of the limb bears it.
bool SubjectLabeller::is_assigned_elsewhere(int track) const {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && accepted_[m] && memories_[m].index == track) return true;
  }
  return false;
}

// The limb's names go where they were read; who bears none there has none.
void SubjectLabeller::apply_hypothesis(LabelledTracks& tracks) {
  std::copy(unreliable_.begin(), unreliable_.end(), unconstrained_.begin());
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    if (memories_[m].index == hypothesis_track_[n] && memories_[m].index >= 0) continue;
    if (accepted_[m]) unconstrained_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    if (memories_[m].index >= 0 && (is_measured(m, tracks) || hypothesis_track_[n] >= 0)) release(m, tracks);
  }
  for (std::size_t m = 0; m < memories_.size(); ++m) {  // doubtful bearers of what the limb takes
    if (memories_[m].index < 0 || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const auto end = hypothesis_track_.begin() + static_cast<std::ptrdiff_t>(limb_.label_count());
    if (std::find(hypothesis_track_.begin(), end, memories_[m].index) != end) release(m, tracks);
  }
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    accepted_[m] = hypothesis_track_[n] >= 0;
    if (hypothesis_track_[n] >= 0 && memories_[m].index != hypothesis_track_[n])
      assign_track(m, hypothesis_track_[n], kNewLabelConfidence, tracks);
  }
  observations_.clear();
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (accepted_[m]) observations_.push_back(observe(m, tracks));
  }
  body_.mark_unreliable(unconstrained_);
  (void)body_.update(observations_);
  for (const kinematics::Observation& one : observations_) {
    const auto m = static_cast<std::size_t>(one.marker);
    if ((one.position - body_.predicted_position(m)).norm() > residual_gate(m)) accepted_[m] = false;
  }
  std::erase_if(observations_,
                [&](const kinematics::Observation& one) { return !accepted_[static_cast<std::size_t>(one.marker)]; });
}

// What the likeliest reading has and is not said: a track that is a marker of the limb in all that are about as good,
// and stays one.
void SubjectLabeller::compute_marginals(const LabelledTracks& tracks) {
  const DistanceConstraintMatcher::AssignmentHypothesis& likeliest = limb_.likeliest();
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const int candidate = likeliest.candidate_of[n];
    const int published = limb_.found() != nullptr ? limb_.found()->candidate_of[n] : limb_.current(n);
    if (candidate < 0 || candidate == published) continue;
    const LimbHypothesisSolver::Probabilities probabilities = limb_.association_probabilities(candidate);
    const TrackId id = limb_.candidate(static_cast<std::size_t>(candidate)).track;
    const int track = tracks.find(id);
    if (probabilities[n] == 0.0 || track < 0 || has_competing_label(track, kCompetingCost, tracks)) continue;
    for (LabelMemory& other : memories_) {
      if (other.ambiguous_track == id) other.ambiguous_track = {};
    }
    LabelMemory& memory = memories_[limb_.marker(n)];
    memory.ambiguous_track = id;
    memory.ambiguous_at = at_;
    memory.marginals.clear();
    for (std::size_t other = 0; other < limb_.label_count(); ++other) {
      if (probabilities[other] > 0.0)
        memory.marginals.push_back(
            {static_cast<std::uint16_t>(limb_.marker(other)), static_cast<float>(probabilities[other])});
    }
  }
}

bool SubjectLabeller::has_current_marginal(const LabelMemory& memory) const {
  return memory.ambiguous_track.names_something() && to_s(at_ - memory.ambiguous_at) <= kMarginalLifetime_s;
}

bool SubjectLabeller::is_ambiguous(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const {
  const TrackId id = tracks[static_cast<int>(track)].id;
  return std::any_of(memories_.begin(), memories_.end(), [&](const LabelMemory& memory) {
    const bool alone = memory.marginals.size() == 1 && memory.marginals[0].marker == marker;
    return memory.ambiguous_track == id && !alone && has_current_marginal(memory);
  });
}

void SubjectLabeller::append_ambiguous_observations(const LabelledTracks& tracks,
                                                    std::vector<AmbiguousObservation>& into) const {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const LabelMemory& memory = memories_[m];
    if (memory.index >= 0 || !has_current_marginal(memory)) continue;
    const int index = tracks.find(memory.ambiguous_track);
    if (index < 0 || tracks.labelled[static_cast<std::size_t>(index)] ||
        !is_unassigned_track(static_cast<std::size_t>(index), tracks))
      continue;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double square_m2 = 0.0;
    for (const Marginal& other : memory.marginals) {
      const Eigen::Vector3d apart = body_.predicted_position(m) - body_.predicted_position(other.marker);
      mean += static_cast<double>(other.probability) * apart;
      square_m2 += static_cast<double>(other.probability) * apart.squaredNorm();
    }
    const double sigma_m = std::sqrt(std::max(0.0, square_m2 - mean.squaredNorm()) / 3.0);
    if (sigma_m > kMaxAmbiguitySigma_m) continue;
    into.push_back({{id_, static_cast<std::uint32_t>(m)}, {tracks[index].position.v + mean}, sigma_m});
  }
}

// Begins with the limb in most trouble. False where there is none.
bool SubjectLabeller::begin_hypotheses(const LabelledTracks& tracks) {
  const int bone = worst_bone();
  if (bone < 0) return false;
  cooldown_[static_cast<std::size_t>(bone)] = kCooldownSets;
  if (!gather_limb(static_cast<std::size_t>(bone), tracks)) return true;
  for (std::size_t b = 0; b < cooldown_.size(); ++b) {
    if (unconstrained_[b] != 0) cooldown_[b] = kCooldownSets;  // read with it
  }
  trial_observations_.clear();
  for (const kinematics::Observation& one : observations_) {
    if (!in_limb_[static_cast<std::size_t>(set_.markers[static_cast<std::size_t>(one.marker)].bone)])
      trial_observations_.push_back(one);
  }
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    initial_tracks_[n] = accepted_[m] ? memories_[m].track : TrackId{};
  }
  limb_.begin(constraints_, body_, trial_observations_, unreliable_);
  return true;
}

// A limb whose readings are more than a set has time for is read on in the next.
void SubjectLabeller::reassociate_limbs(LabelledTracks& tracks) {
  for (int& sets : cooldown_) sets = std::max(0, sets - 1);
  std::fill(unexplained_.begin(), unexplained_.end(), 0);
  if (observations_.size() == memories_.size()) {
    std::fill(unreliable_.begin(), unreliable_.end(), 0);
    limb_.stop();
    return;
  }
  int left = settings_.limb_work;
  for (int limb = 0; limb < kMaxLimbsPerSet; ++limb) {
    count_unexplained(tracks);
    if (!limb_.busy() && !begin_hypotheses(tracks)) return;
    left -= limb_.advance(constraints_, left);
    if (limb_.busy()) return;
    compute_marginals(tracks);
    if (limb_.found() != nullptr && map_hypothesis(*limb_.found(), tracks)) {
      apply_hypothesis(tracks);
    } else {
      body_.mark_unreliable(unreliable_);
      (void)body_.update(observations_);
    }
  }
}

}  // namespace mocap::label
