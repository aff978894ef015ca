// The part of SubjectLabeller that labels limbs as a whole where labels are missing while unassigned tracks are near.

#include <algorithm>
#include <cmath>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A missing label of another limb does not compete for a track that is farther from its prediction. Chosen by hand; not
// yet measured.
constexpr double kCompetingRadius_m = 0.3;
// Association cost (chi-square units with the log determinant) below which a missing label of another limb competes for
// a track (decisions 0015 and 0018).
constexpr double kCompetingCost = 15.0;
// Bounds the time of a set.
constexpr int kMaxLimbsPerSet = 2;
// Time until an ambiguity ends unless the limb is searched again; a limb is searched again within it (decision 0014).
constexpr double kMarginalLifetime_s = 0.05;
// Largest spread, rms of one axis, of an ambiguous observation: a larger one does not constrain its limb (decision
// 0010). Chosen by hand; not yet measured.
constexpr double kMaxAmbiguitySigma_m = 0.1;

}  // namespace

// Cost below which a missing label of another limb keeps the track from this marker: 15, or the cost of this marker if
// that is higher. Of two lost limbs, the limb with the less likely marker therefore waits (decision 0018).
double SubjectLabeller::competing_cost(std::size_t marker, int index, const LabelledTracks& tracks) const {
  if (!places_[marker].known) return kCompetingCost;
  geometry::AllowedPair here;
  assignment_cost(marker, static_cast<std::size_t>(index), tracks, here);
  return std::isfinite(here.cost) ? std::max(kCompetingCost, here.cost) : kCompetingCost;
}

// Whether a missing label outside the limb has an association cost below `below` for the track. Track association, or
// later motion, resolves such a track.
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

// Translates a hypothesis, whose candidates are of the set in which the search began, to tracks of this set. A track
// that ended, coasts, belongs to another limb or to another subject, or has a competing label of another limb is left
// out. Returns false if an accepted label of the limb has changed its track since the search began, unless to the track
// of the hypothesis.
bool SubjectLabeller::map_hypothesis(const DistanceConstraintMatcher::AssignmentHypothesis& found,
                                     const LabelledTracks& tracks) {
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    const int candidate = found.candidate_of[n];
    const TrackId id = candidate < 0 ? TrackId{} : limb_.candidate(static_cast<std::size_t>(candidate)).track;
    if (accepted_[m] && memories_[m].track != initial_tracks_[n] && memories_[m].track != id) return false;
    hypothesis_track_[n] = candidate < 0 ? LabelledTracks::kNone : tracks.find(id);
    if (hypothesis_track_[n] < 0) continue;
    const bool gone = tracks[hypothesis_track_[n]].state == TrackState::Coasting ||
                      is_assigned_elsewhere(hypothesis_track_[n]) || has_other_subject(hypothesis_track_[n], tracks);
    const bool is_new_assignment = candidate != limb_.current(n);
    if (gone || (is_new_assignment &&
                 (has_competing_label(hypothesis_track_[n], competing_cost(m, hypothesis_track_[n], tracks), tracks) ||
                  is_ambiguous_elsewhere(id))))
      hypothesis_track_[n] = LabelledTracks::kNone;
  }
  return true;
}

// Whether the last hypotheses of another limb left the track ambiguous among the markers of that limb.
bool SubjectLabeller::is_ambiguous_elsewhere(TrackId track) const {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && memories_[m].index < 0 && memories_[m].ambiguous_track == track &&
        has_current_marginal(memories_[m]))
      return true;
  }
  return false;
}

// Whether an accepted label outside the limb has the track.
bool SubjectLabeller::is_assigned_elsewhere(int track) const {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && accepted_[m] && memories_[m].index == track) return true;
  }
  return false;
}

// Whether a label of another subject has the track: it may have got it while the search went on.
bool SubjectLabeller::has_other_subject(int track, const LabelledTracks& tracks) const {
  return tracks.labelled[static_cast<std::size_t>(track)] &&
         std::ranges::find(memories_, track, &LabelMemory::index) == memories_.end();
}

// Assigns the tracks of the hypothesis to the labels of the limb and releases the other labels, fits the pose without
// priors on bones whose accepted labels changed, and withdraws the acceptance of labels with residuals above the gate.
void SubjectLabeller::apply_hypothesis(LabelledTracks& tracks) {
  std::copy(unreliable_.begin(), unreliable_.end(), unconstrained_.begin());
  for (std::size_t n = 0; n < limb_.label_count(); ++n) {
    const std::size_t m = limb_.marker(n);
    if (memories_[m].index == hypothesis_track_[n] && memories_[m].index >= 0) continue;
    if (accepted_[m]) unconstrained_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    if (memories_[m].index >= 0 && (is_measured(m, tracks) || hypothesis_track_[n] >= 0)) release(m, tracks);
  }
  // Labels outside the limb that are not accepted release the tracks that are assigned to the limb.
  for (std::size_t m = 0; m < memories_.size(); ++m) {
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

// Stores the association probabilities of each track that the best hypothesis assigns but the solver does not report,
// because hypotheses about as good assign the track to other markers of the limb.
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

// A track whose only marginal is `marker` itself is not ambiguous for that marker.
bool SubjectLabeller::is_ambiguous(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const {
  const TrackId id = tracks[static_cast<int>(track)].id;
  return std::any_of(memories_.begin(), memories_.end(), [&](const LabelMemory& memory) {
    const bool alone = memory.marginals.size() == 1 && memory.marginals[0].marker == marker;
    return memory.ambiguous_track == id && !alone && has_current_marginal(memory);
  });
}

// The observation is of the most likely marker. The track is at marker k with probability p_k, so the most likely
// marker is at the track plus the predicted difference to marker k: mean and standard deviation are over these
// positions. The update with the mean of the association distribution is that of JPDA (Bar-Shalom and Fortmann 1988).
void SubjectLabeller::append_ambiguous_observations(const LabelledTracks& tracks, AmbiguousObservations& into) const {
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
    const Label label{id_, static_cast<std::uint32_t>(m)};
    if (!into.try_push_back({label, {tracks[index].position.v + mean}, sigma_m})) return;
  }
}

// Starts the search for the limb with most unexplained labels. Returns false if there is none.
bool SubjectLabeller::begin_hypotheses(const LabelledTracks& tracks) {
  const int bone = worst_bone();
  if (bone < 0) return false;
  cooldown_[static_cast<std::size_t>(bone)] = kCooldownSets;
  if (!gather_limb(static_cast<std::size_t>(bone), tracks)) return true;
  for (std::size_t b = 0; b < cooldown_.size(); ++b) {
    if (unconstrained_[b] != 0) cooldown_[b] = kCooldownSets;  // part of the limb
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

// Evaluates at most `limb_work` hypotheses in a set; an incomplete search continues in the next set on the body and
// tracks of the set in which it began (decision 0011).
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
