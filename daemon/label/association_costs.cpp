// The part of SubjectLabeller that computes the costs of single assignments and rejects labels that contradict the
// pose.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// The gate of the residual from the fitted pose: a constant, twice the running mean of all markers, and twice that of
// the marker itself (bounded), which is larger where skin slides. Chosen by hand; not yet measured.
constexpr double kMinResidualGate_m = 0.012;
constexpr double kMaxUsualResidual_m = 0.02;
constexpr double kUsualResidualRate = 0.03;  // of the marker's running mean, for each set
// Rigid neighbours support an established label up to the thickness of a limb. Chosen by hand; not yet measured.
constexpr double kMaxSupportedResidual_m = 0.08;
// Half the chi-square of a distance at 3 sigma: such a distance contradicts the label.
constexpr double kContradictingDistanceCost = 4.5;
// Gate of an assignment: chi-square of 16 with 3 degrees of freedom, which rejects one true track in 900.
constexpr double kGateSigmas = 4.0;
// Mahalanobis distance up to which a missing neighbour counts as an alternative: the prediction of a moving limb is
// overconfident (decision 0016).
constexpr double kNeighbourGateSigmas = 7.0;
// Tracks up to this multiple of `most_gate_m` have a cost, and so compete with other assignments. Chosen by hand; not
// yet measured.
constexpr double kCompetingGateRatio = 2.0;
// Lever of the second-order error of a predicted position: a rotation by d / L moves a marker by d along the tangent
// and by d^2 / 2 L off the tangent. L is the length of a forearm or shin.
constexpr double kLimbLength_m = 0.35;
// Log odds of track continuity, in chi-square units: twice LimbHypothesisSolver's kTrackContinuityLogOdds. Chosen by
// hand; not yet measured.
constexpr double kContinuityBonus = 6.0;

// Change of an inter-marker distance that skin allows.
double tolerance_of(const identify::InterMarkerDistance& constraint, double base_m) {
  return base_m + 0.05 * constraint.max_m;
}

}  // namespace

// Whether the distances to the accepted neighbours allow the marker at this position: at least three quarters do.
bool SubjectLabeller::satisfies_distances(std::size_t marker, const Eigen::Vector3d& at,
                                          const LabelledTracks& tracks) const {
  int satisfied_count = 0;
  int violated_count = 0;
  for (const identify::InterMarkerDistance& constraint : constraints_.of(marker)) {
    const auto other = static_cast<std::size_t>(constraint.other);
    if (!accepted_[other] || !is_measured(other, tracks)) continue;
    const double apart = (tracks[memories_[other].index].position.v - at).norm();
    const double over = std::max(constraint.min_m - apart, apart - constraint.max_m);
    (over > tolerance_of(constraint, settings_.distance_tolerance_m) ? violated_count : satisfied_count) += 1;
  }
  return violated_count <= satisfied_count / 3;
}

// Whether the track is detected in this set and is not trusted as the track of an accepted label. A candidate takes
// part only while it has a label.
bool SubjectLabeller::is_unassigned_track(std::size_t track, const LabelledTracks& tracks) const {
  const TrackedMarker& one = (*tracks.tracked)[track];
  const bool is_unlabelled_candidate = one.state == TrackState::Candidate && !tracks.labelled[track];
  return !tracks.trusted[track] && one.state != TrackState::Coasting && !is_unlabelled_candidate &&
         one.position.v.allFinite() && one.covariance_m2.allFinite();
}

Eigen::Matrix3d SubjectLabeller::innovation_covariance(std::size_t marker, const TrackedMarker& track) const {
  const PredictedPlace& place = places_[marker];
  const double nonlinearity_m =
      accepted_[marker] ? 0.0 : (track.position.v - place.at).squaredNorm() / (2.0 * kLimbLength_m);
  return place.covariance_m2 + track.covariance_m2 + isotropic_covariance(nonlinearity_m);
}

bool SubjectLabeller::inside_gate(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const {
  const TrackedMarker& one = (*tracks.tracked)[track];
  const Eigen::Vector3d off = one.position.v - places_[marker].at;
  if (!(off.norm() < settings_.most_gate_m)) return false;
  return off.dot(innovation_covariance(marker, one).inverse() * off) < kGateSigmas * kGateSigmas;
}

bool SubjectLabeller::may_be_neighbour(std::size_t marker, std::uint32_t track, double below,
                                       const LabelledTracks& tracks) const {
  const std::span<const identify::InterMarkerDistance> constraints = constraints_.of(marker);
  return std::any_of(constraints.begin(), constraints.end(), [&](const identify::InterMarkerDistance& constraint) {
    const auto other = static_cast<std::size_t>(constraint.other);
    if (memories_[other].index >= 0 || !places_[other].known) return false;
    geometry::AllowedPair pair;
    assignment_cost(other, track, tracks, pair, kNeighbourGateSigmas);
    return pair.cost < below;
  });
}

// Squared Mahalanobis distance of the track from the predicted position, plus the log determinant of the innovation
// covariance (so that a marker whose position is unknown does not compete), minus the evidence of track continuity. The
// cost is infinite if the track cannot be the marker. A tentative track has a cost only for the label that it was
// detected for, or for its own label.
void SubjectLabeller::assignment_cost(std::size_t marker, std::size_t index, const LabelledTracks& tracks,
                                      geometry::AllowedPair& into, double max_sigmas) const {
  into.cost = std::numeric_limits<double>::infinity();
  const TrackedMarker& track = (*tracks.tracked)[index];
  const PredictedPlace& place = places_[marker];
  const Eigen::Vector3d off = track.position.v - place.at;
  if (!(off.norm() < kCompetingGateRatio * settings_.most_gate_m)) return;
  const bool own = previous_tracks_[marker] == static_cast<int>(index);
  const bool is_expected = tracks.predicted_label(index) == Label{id_, static_cast<std::uint32_t>(marker)};
  if (track.state == TrackState::Tentative && !is_expected && !own) return;
  const Eigen::Matrix3d spread = innovation_covariance(marker, track);
  const double apart = off.dot(spread.inverse() * off);
  if (!(apart < max_sigmas * max_sigmas)) return;
  if (!own && !satisfies_distances(marker, track.position.v, tracks)) return;
  const double width = std::log(spread.determinant() / std::pow(kFittedMarkerSigma_m, 6));
  into.cost = apart + std::max(0.0, width) - kContinuityBonus * continuity_of(marker, static_cast<int>(index), tracks);
}

void SubjectLabeller::build_costs(const LabelledTracks& tracks, std::size_t first_row, std::size_t max_pairs,
                                  std::vector<geometry::AllowedPair>& pairs) {
  participates_ = false;
  if (observations_.size() == memories_.size()) return;
  unassigned_tracks_.clear();
  for (std::size_t i = 0; i < tracks.labelled.size(); ++i) {
    if (is_unassigned_track(i, tracks)) unassigned_tracks_.push_back(static_cast<int>(i));
  }
  if (unassigned_tracks_.empty()) return;
  participates_ = true;
  predict_places();
  geometry::AllowedPair pair;
  const auto add = [&](std::size_t marker, std::size_t index) {
    pair.row = static_cast<std::uint32_t>(first_row + marker);
    pair.column = static_cast<std::uint32_t>(index);
    assignment_cost(marker, index, tracks, pair);
    if (std::isfinite(pair.cost) && pairs.size() < max_pairs) pairs.push_back(pair);
  };
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (!places_[m].known) continue;
    if (accepted_[m]) add(m, static_cast<std::size_t>(previous_tracks_[m]));
    for (const int i : unassigned_tracks_) add(m, static_cast<std::size_t>(i));
  }
}

void SubjectLabeller::release_unassigned(std::span<const std::uint32_t> columns, LabelledTracks& tracks) {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool stays = previous_tracks_[m] >= 0 && columns[m] == static_cast<std::uint32_t>(previous_tracks_[m]);
    const bool coasts =
        previous_tracks_[m] >= 0 && columns[m] == geometry::Assigner::kUnassigned && !is_measured(m, tracks);
    if (!stays && !coasts) release(m, tracks);
  }
}

void SubjectLabeller::assign(std::size_t marker, std::uint32_t track, LabelledTracks& tracks) {
  assign_track(marker, static_cast<int>(track), kNewLabelConfidence, tracks);
}

// Largest distance, m, of a marker from the fitted pose at which its label counts as measured.
double SubjectLabeller::residual_gate(std::size_t marker) const {
  return kMinResidualGate_m + 2.0 * usual_residual_m_ +
         2.0 * std::min(kMaxUsualResidual_m, memories_[marker].usual_residual_m);
}

// Whether the distances to accepted neighbours, one of them on the same bone, confirm an established label whose
// residual is above the gate: a joint may rotate farther than its prior allows, and a fit may fail, but bones keep
// their lengths. Two labels that would both be nearer with exchanged tracks are not supported.
bool SubjectLabeller::supported_by_rigid_neighbours(std::size_t marker, double off_m,
                                                    const LabelledTracks& tracks) const {
  if (off_m > kMaxSupportedResidual_m || memories_[marker].confidence < kEstablishedConfidence) return false;
  const Eigen::Vector3d& at = tracks[memories_[marker].index].position.v;
  int rigid = 0;
  int satisfied_count = 0;
  for (const identify::InterMarkerDistance& constraint : constraints_.of(marker)) {
    const auto other = static_cast<std::size_t>(constraint.other);
    if (!accepted_[other] || !is_measured(other, tracks)) continue;
    if (DistanceConstraintMatcher::cost_of(constraint, (tracks[memories_[other].index].position.v - at).norm()) >
        kContradictingDistanceCost)
      return false;
    ++satisfied_count;
    rigid += constraint.rigid ? 1 : 0;
  }
  if (rigid < 1 || satisfied_count < 2) return false;
  return std::none_of(observations_.begin(), observations_.end(), [&](const kinematics::Observation& other) {
    const auto b = static_cast<std::size_t>(other.marker);
    if (b == marker || (at - body_.predicted_position(b)).norm() >= off_m) return false;
    return (other.position - body_.predicted_position(marker)).norm() < off_m;
  });
}

// Fits the pose to all detected labels, withdraws the acceptance of labels with residuals above the gate, releases
// labels that stay above it, and updates confidence and running means. Fits again without the labels that were
// withdrawn.
void SubjectLabeller::reject_contradicted(LabelledTracks& tracks) {
  bool fitted = true;
  observations_.clear();
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const bool labelled = is_measured(m, tracks);
    motion_consistent_[m] = accepted_[m] && memories_[m].index == previous_tracks_[m];
    fitted = fitted && labelled == accepted_[m] && (!labelled || memories_[m].index == previous_tracks_[m]);
    accepted_[m] = labelled;
    if (labelled) observations_.push_back(observe(m, tracks));
  }
  if (!fitted) (void)body_.update(observations_);
  double sum = 0.0;
  std::size_t left = 0;
  for (const kinematics::Observation& one : observations_) {
    const auto m = static_cast<std::size_t>(one.marker);
    LabelMemory& memory = memories_[m];
    const double off = (one.position - body_.predicted_position(m)).norm();
    const double max_residual_m = residual_gate(m);
    const bool is_supported =
        off >= max_residual_m && motion_consistent_[m] && supported_by_rigid_neighbours(m, off, tracks);
    accepted_[m] = off < max_residual_m || is_supported;
    memory.reject_count = is_supported                 ? 0
                          : off > 2.0 * max_residual_m ? kMaxRejectCount
                          : off > max_residual_m       ? memory.reject_count + 1
                                                       : std::max(0, memory.reject_count - 1);
    memory.confidence += 0.1F * ((is_supported   ? kEstablishedConfidence
                                  : accepted_[m] ? 1.0F
                                                 : 0.3F) -
                                 memory.confidence);
    // A track that its own motion or the motion of the body did not predict counts as a new label.
    if (!motion_consistent_[m]) memory.confidence = std::min(memory.confidence, kNewLabelConfidence);
    if (memory.confidence >= kEstablishedConfidence) establish(m);
    if (memory.reject_count >= kMaxRejectCount) {
      release(m, tracks);
      unreliable_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    }
    if (!accepted_[m]) continue;
    sum += off;
    memory.usual_residual_m += kUsualResidualRate * (off - memory.usual_residual_m);
    observations_[left++] = one;
  }
  if (left > 0) usual_residual_m_ += 0.05 * (sum / static_cast<double>(left) - usual_residual_m_);
  if (left == observations_.size()) return;
  observations_.erase(observations_.begin() + static_cast<std::ptrdiff_t>(left), observations_.end());
  (void)body_.update(observations_);
}

}  // namespace mocap::label
