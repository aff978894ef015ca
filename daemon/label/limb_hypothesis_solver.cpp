#include "label/limb_hypothesis_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mocap::label {
namespace {

using AssignmentHypothesis = DistanceConstraintMatcher::AssignmentHypothesis;

// All costs are negative log likelihoods (half chi-square). The first five were chosen by hand and are not yet
// measured.
constexpr double kMissedDetectionCost = 12.0;    // of a label without a track
constexpr double kTrackContinuityLogOdds = 3.0;  // of a track that had the label
constexpr double kClutterLogOdds = 5.0;          // of a tentative track
constexpr double kLabelRevisionCost = 6.0;       // of a hypothesis that changes an established label
constexpr double kHypothesisMargin = 5.0;        // over the current assignment
// Margins over a hypothesis that contradicts a label: it leaves the track unassigned, gives it to a marker of another
// bone, or gives it to a marker of the same bone. Markers of one bone are separated by the twist of the bone, the least
// known rotation. The values exceed the error of a pose fit, which may end in a local minimum, and are below the cost
// of a missed detection (decision 0013: 13 leaves one label in twenty unassigned).
constexpr double kUnassignedMargin = 6.5;
constexpr double kOtherBoneMargin = 7.5;
constexpr double kSameBoneMargin = 10.0;
// A hypothesis that costs more than the best by this is not evaluated again from the pose of the best. Chosen by hand;
// not yet measured.
constexpr double kPruningCost = 40.0;
// Costs rank hypotheses better than they calibrate them: probabilities are exp(-dcost / T) (decision 0010).
constexpr double kLikelihoodTemperature = 2.0;
// Bounds of the search. Chosen by hand; not yet measured.
constexpr std::size_t kAlternativesPerLabel = 3;  // in each of two searches for a new label
constexpr std::size_t kMaxSwapHypotheses = 48;
constexpr std::size_t kMaxAssignments = 1 + DistanceConstraintMatcher::kMaxAssignments + kMaxSwapHypotheses +
                                        2 * kAlternativesPerLabel * DistanceConstraintMatcher::kMaxLimbLabels;

}  // namespace

LimbHypothesisSolver::LimbHypothesisSolver(const MarkerSet& set, const pose::SkeletonTrackerSettings& follow)
    : body_(set, follow) {
  for (const MarkerOnBone& marker : set.markers) bone_of_.push_back(marker.bone);
  candidates_.reserve(DistanceConstraintMatcher::kMaxCandidates);
  rest_observations_.reserve(set.markers.size());
  trial_observations_.reserve(set.markers.size());
  unreliable_.resize(set.skeleton.bones.size());
  unconstrained_.resize(set.skeleton.bones.size());
  best_pose_.reserve(set.skeleton.bones.size());
  same_bone_ambiguities_.reserve(DistanceConstraintMatcher::kMaxLimbLabels);
  hypotheses_.reserve(kMaxAssignments);
}

void LimbHypothesisSolver::clear() {
  matcher_.clear();
  candidates_.clear();
  for (auto& continuities : continuity_) continuities.fill(0.0);
  current_.candidate_of.fill(kUnassigned);
  likeliest_ = current_;
  stop();
  found_ = false;
}

bool LimbHypothesisSolver::add_label(std::size_t marker) { return matcher_.add_label(marker); }

bool LimbHypothesisSolver::add_candidate(const CandidateTrack& candidate) {
  if (!matcher_.add_candidate(candidate.at)) return false;
  candidates_.push_back(candidate);
  return true;
}

void LimbHypothesisSolver::allow(std::size_t label, std::size_t candidate, double cost, double continuity) {
  continuity_[label][candidate] = continuity;
  matcher_.allow(
      label, candidate,
      cost + (candidates_[candidate].is_young ? kClutterLogOdds : 0.0) - kTrackContinuityLogOdds * continuity);
}

void LimbHypothesisSolver::begin(const identify::DistanceConstraints& constraints, const pose::SkeletonTracker& body,
                                 std::span<const kinematics::Observation> others, std::span<const char> unreliable) {
  body_ = body;
  rest_observations_.assign(others.begin(), others.end());
  unreliable_.assign(unreliable.begin(), unreliable.end());
  found_ = false;
  evaluated_count_ = 0;
  next_reevaluated_ = 0;
  hypotheses_.clear();
  hypotheses_.push_back(current_);
  add_hypothesis(matcher_.solve(constraints, kMissedDetectionCost));
  stage_ = hypotheses_.size() > 1 ? Stage::Initial : Stage::Done;
}

int LimbHypothesisSolver::advance(const identify::DistanceConstraints& constraints, int most) {
  int done = 0;
  while (busy()) {
    if (evaluated_count_ < hypotheses_.size()) {
      if (done == most) break;
      evaluate(evaluated_count_++);
      ++done;
    } else if (stage_ == Stage::SameBoneAmbiguities && next_reevaluated_ < hypotheses_.size()) {
      if (done == most) break;
      if (reevaluate(next_reevaluated_++)) ++done;
    } else if (!propose_next(constraints)) {
      stage_ = Stage::Done;
      select_best();
    }
  }
  return done;
}

const AssignmentHypothesis& LimbHypothesisSolver::best_evaluated() const {
  const auto end = hypotheses_.begin() + static_cast<std::ptrdiff_t>(evaluated_count_);
  return *std::min_element(hypotheses_.begin(), end, [](const AssignmentHypothesis& a, const AssignmentHypothesis& b) {
    return a.cost < b.cost;
  });
}

// Proposes hypotheses when all proposed ones are evaluated. Returns false when the search is complete.
bool LimbHypothesisSolver::propose_next(const identify::DistanceConstraints& constraints) {
  const std::size_t before = hypotheses_.size();
  if (stage_ == Stage::Initial) {
    if (!(best_evaluated().cost + kHypothesisMargin < hypotheses_[0].cost)) return false;
    stage_ = Stage::SwapNeighbours;
    best_ = hypotheses_[0];
    swap_limit_ = before + kMaxSwapHypotheses;
  }
  if (stage_ == Stage::SwapNeighbours) {
    if (best_evaluated().cost < best_.cost) {
      best_ = best_evaluated();
      swap_neighbours(constraints);
      if (hypotheses_.size() > before) return true;
    }
    stage_ = Stage::Alternatives;
    best_ = best_evaluated();
    next_label_ = 0;
  }
  if (stage_ == Stage::SameBoneAmbiguities) return false;
  if (!enumerate_next_alternatives(constraints)) stage_ = Stage::SameBoneAmbiguities;
  return true;
}

bool LimbHypothesisSolver::add_hypothesis(const AssignmentHypothesis& hypothesis) {
  const auto label_count = static_cast<std::ptrdiff_t>(matcher_.label_count());
  const bool known = std::any_of(hypotheses_.begin(), hypotheses_.end(), [&](const AssignmentHypothesis& there) {
    return std::equal(there.candidate_of.begin(), there.candidate_of.begin() + label_count,
                      hypothesis.candidate_of.begin());
  });
  if (!known) hypotheses_.push_back(hypothesis);
  return !known;
}

void LimbHypothesisSolver::add_hypothesis(std::span<const AssignmentHypothesis> found) {
  for (const AssignmentHypothesis& one : found) (void)add_hypothesis(one);
}

// Many assignments of a limb cost about the same by distances, and the list of the cheapest may lack the one with the
// best pose: from the best one, the track of each new label is moved to, or exchanged with, each neighbour without an
// established label (decision 0008).
void LimbHypothesisSolver::swap_neighbours(const identify::DistanceConstraints& constraints) {
  for (std::size_t a = 0; a < label_count(); ++a) {
    if (best_.candidate_of[a] < 0 || current_.candidate_of[a] >= 0) continue;
    for (const identify::InterMarkerDistance& constraint : constraints.of(marker(a))) {
      std::size_t b = 0;
      while (b < label_count() && marker(b) != static_cast<std::size_t>(constraint.other)) ++b;
      if (b == label_count() || current_.candidate_of[b] >= 0) continue;
      AssignmentHypothesis other = best_;
      std::swap(other.candidate_of[a], other.candidate_of[b]);
      if (hypotheses_.size() < swap_limit_) (void)add_hypothesis(other);
    }
  }
}

// The cheapest assignments by distances may all agree on a label because they differ in other labels. Alternatives to
// each new label that no hypothesis contradicts are therefore enumerated explicitly (decision 0004).
bool LimbHypothesisSolver::enumerate_next_alternatives(const identify::DistanceConstraints& constraints) {
  const std::size_t before = hypotheses_.size();
  while (next_label_ < label_count() && hypotheses_.size() == before) {
    const std::size_t label = next_label_++;
    const int candidate = best_.candidate_of[label];
    if (candidate < 0 || candidate == current_.candidate_of[label]) continue;
    const bool is_contested =
        std::any_of(hypotheses_.begin(), hypotheses_.end(),
                    [&](const AssignmentHypothesis& other) { return contests(other, best_, label); });
    if (!is_contested) enumerate_alternatives(label, constraints);
  }
  return hypotheses_.size() > before;
}

// Two searches: with the other labels as in the best hypothesis, and with the other labels free.
void LimbHypothesisSolver::enumerate_alternatives(std::size_t label, const identify::DistanceConstraints& constraints) {
  add_hypothesis(matcher_.solve_excluding(constraints, kMissedDetectionCost, label, best_, kAlternativesPerLabel));
  AssignmentHypothesis alone;
  alone.candidate_of.fill(kUnassigned);
  alone.candidate_of[label] = best_.candidate_of[label];
  add_hypothesis(matcher_.solve_excluding(constraints, kMissedDetectionCost, label, alone, kAlternativesPerLabel));
}

// Collects the observations of a hypothesis. Returns its cost apart from the pose: missed detections, clutter,
// continuity, and revision of established labels.
double LimbHypothesisSolver::gather_observations(const AssignmentHypothesis& hypothesis) {
  trial_observations_.assign(rest_observations_.begin(), rest_observations_.end());
  std::copy(unreliable_.begin(), unreliable_.end(), unconstrained_.begin());
  bool contradicts = false;
  double cost = 0.0;
  for (std::size_t n = 0; n < label_count(); ++n) {
    const int at = hypothesis.candidate_of[n];
    if (current_.candidate_of[n] >= 0 && at != current_.candidate_of[n]) {
      contradicts = true;
      unconstrained_[static_cast<std::size_t>(bone_of(n))] = 1;
    }
    if (at < 0) {
      cost += kMissedDetectionCost;
      continue;
    }
    const CandidateTrack& candidate = candidates_[static_cast<std::size_t>(at)];
    trial_observations_.push_back({static_cast<int>(marker(n)), candidate.at, candidate.sigma_m});
    cost += (candidate.is_young ? kClutterLogOdds : 0.0) -
            kTrackContinuityLogOdds * continuity_[n][static_cast<std::size_t>(at)];
  }
  if (contradicts) cost += kLabelRevisionCost;
  body_.mark_unreliable(unconstrained_);
  return cost;
}

// The pose fit may stop early when the cost exceeds that of the best hypothesis by the largest margin.
void LimbHypothesisSolver::evaluate(std::size_t hypothesis) {
  const double cost = gather_observations(hypotheses_[hypothesis]);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hypothesis; ++i) least = std::min(least, hypotheses_[i].cost);
  hypotheses_[hypothesis].cost =
      cost + body_.evaluate_hypothesis(trial_observations_, least + kSameBoneMargin - cost).cost;
  if (hypotheses_[hypothesis].cost < least)
    best_pose_.assign(body_.pose().locals().begin(), body_.pose().locals().end());
}

// A fit from the predicted pose may miss the twist of a bone. A hypothesis that has one marker of a bone where the best
// one has another marker of this bone is evaluated again from the pose of the best hypothesis, with the bone swung from
// one marker to the other. Returns false for other hypotheses.
bool LimbHypothesisSolver::reevaluate(std::size_t hypothesis) {
  AssignmentHypothesis& one = hypotheses_[hypothesis];
  const AssignmentHypothesis& best = best_evaluated();
  if (one.cost > best.cost + kPruningCost) return false;
  find_same_bone_ambiguities(one, best);
  if (same_bone_ambiguities_.empty()) return false;
  const double cost = gather_observations(one);
  const double reevaluated_cost =
      cost + body_.evaluate_from(best_pose_, same_bone_ambiguities_, trial_observations_, one.cost - cost).cost;
  if (reevaluated_cost < best.cost) best_pose_.assign(body_.pose().locals().begin(), body_.pose().locals().end());
  one.cost = std::min(one.cost, reevaluated_cost);
  return true;
}

void LimbHypothesisSolver::find_same_bone_ambiguities(const AssignmentHypothesis& hypothesis,
                                                      const AssignmentHypothesis& best) {
  same_bone_ambiguities_.clear();
  for (std::size_t n = 0; n < label_count(); ++n) {
    const int candidate = hypothesis.candidate_of[n];
    if (candidate < 0 || candidate == best.candidate_of[n] || bone_of(n) == 0) continue;
    const std::size_t other = label_at(best, candidate);
    if (other != label_count() && bone_of(other) == bone_of(n))
      same_bone_ambiguities_.push_back({static_cast<int>(marker(n)), static_cast<int>(marker(other))});
  }
}

// Whether another hypothesis is about as good as the best and contradicts the candidate that the best gives to the
// label.
bool LimbHypothesisSolver::contests(const AssignmentHypothesis& other, const AssignmentHypothesis& best,
                                    std::size_t label) const {
  const int candidate = best.candidate_of[label];
  if (candidate < 0 || other.candidate_of[label] == candidate) return false;
  return other.cost <= best.cost + margin(label, label_at(other, candidate));
}

// Margin by which a hypothesis must be worse that gives the candidate of `label` to `other_label`, or to none.
double LimbHypothesisSolver::margin(std::size_t label, std::size_t other_label) const {
  if (other_label == label_count()) return kUnassignedMargin;
  return bone_of(other_label) == bone_of(label) ? kSameBoneMargin : kOtherBoneMargin;
}

// The label that a hypothesis gives to a candidate; label_count() if none.
std::size_t LimbHypothesisSolver::label_at(const AssignmentHypothesis& hypothesis, int candidate) const {
  const auto end = hypothesis.candidate_of.begin() + static_cast<std::ptrdiff_t>(label_count());
  return static_cast<std::size_t>(std::find(hypothesis.candidate_of.begin(), end, candidate) -
                                  hypothesis.candidate_of.begin());
}

// Removes from the best hypothesis the labels that other hypotheses contest.
void LimbHypothesisSolver::select_best() {
  best_ = best_evaluated();
  found_ = best_.cost + kHypothesisMargin < hypotheses_[0].cost;
  likeliest_ = best_;
  for (const AssignmentHypothesis& other : hypotheses_) {
    for (std::size_t n = 0; n < label_count(); ++n) {
      if (contests(other, likeliest_, n)) best_.candidate_of[n] = kUnassigned;
    }
  }
}

LimbHypothesisSolver::Probabilities LimbHypothesisSolver::association_probabilities(int candidate) const {
  Probabilities probabilities{};
  const std::size_t likeliest = label_at(likeliest_, candidate);
  if (likeliest == label_count()) return probabilities;
  double sum = 0.0;
  for (const AssignmentHypothesis& one : hypotheses_) {
    const std::size_t label = label_at(one, candidate);
    if (one.cost > likeliest_.cost + margin(likeliest, label)) continue;
    if (label == label_count()) return {};
    const double probability = std::exp((likeliest_.cost - one.cost) / kLikelihoodTemperature);
    probabilities[label] += probability;
    sum += probability;
  }
  for (double& probability : probabilities) probability /= sum;
  return probabilities;
}

void LimbHypothesisSolver::archive(Archive& members) {
  members(stage_);
  if (!busy()) return;  // the next search begins with `clear`
  members(matcher_, candidates_, continuity_, current_, body_, rest_observations_, unreliable_, hypotheses_);
  members(evaluated_count_, swap_limit_, next_label_, next_reevaluated_, best_, likeliest_, found_, best_pose_);
  if (members.is_reading() && !has_valid_indices()) members.fail();
}

// Whether the members that were read refer to existing markers, candidates and hypotheses.
bool LimbHypothesisSolver::has_valid_indices() const {
  const auto is_valid = [&](const AssignmentHypothesis& one) {
    return std::ranges::all_of(std::span(one.candidate_of).first(label_count()), [&](int candidate) {
      return candidate >= kUnassigned && candidate < static_cast<int>(candidates_.size());
    });
  };
  const auto is_marker = [&](std::size_t m) { return m < bone_of_.size(); };
  for (std::size_t n = 0; n < label_count(); ++n) {
    if (!is_marker(marker(n))) return false;
  }
  for (const kinematics::Observation& one : rest_observations_) {
    if (one.marker < 0 || !is_marker(static_cast<std::size_t>(one.marker))) return false;
  }
  const bool has_best = stage_ != Stage::Initial;  // before, best_ is of another search
  return stage_ <= Stage::Done && candidates_.size() == matcher_.candidate_count() && !hypotheses_.empty() &&
         evaluated_count_ <= hypotheses_.size() && next_reevaluated_ <= hypotheses_.size() &&
         (evaluated_count_ == 0 || best_pose_.size() == unreliable_.size()) && is_valid(current_) &&
         (!has_best || is_valid(best_)) && std::ranges::all_of(hypotheses_, is_valid);
}

}  // namespace mocap::label
