#include "label/distance_constraint_matcher.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace mocap::label {
namespace {

constexpr double kForbidden = std::numeric_limits<double>::infinity();
// Standard deviation of an inter-marker distance: a constant for skin and a share of the distance. Chosen by hand; not
// yet measured.
constexpr double kDistanceSigma_m = 0.008;
constexpr double kRelativeDistanceSigma = 0.02;
// Cost from which on a distance is an outlier: larger deviations do not separate hypotheses. Chosen by hand; not yet
// measured.
constexpr double kMaxDistanceCost = 20.0;
// Nodes of the search tree; bounds the time of a search. Chosen by hand; not yet measured.
constexpr int kMaxSearchSteps = 6000;

}  // namespace

DistanceConstraintMatcher::DistanceConstraintMatcher() { hypotheses_.reserve(kMaxAssignments + 1); }

void DistanceConstraintMatcher::clear() {
  label_count_ = candidate_count_ = 0;
  hypotheses_.clear();
}

bool DistanceConstraintMatcher::add_label(std::size_t marker) {
  if (label_count_ == kMaxLimbLabels) return false;
  markers_[label_count_] = marker;
  costs_[label_count_].fill(kForbidden);
  ++label_count_;
  return true;
}

bool DistanceConstraintMatcher::add_candidate(const Eigen::Vector3d& at) {
  if (candidate_count_ == kMaxCandidates) return false;
  positions_[candidate_count_++] = at;
  return true;
}

void DistanceConstraintMatcher::allow(std::size_t label, std::size_t candidate, double cost) {
  costs_[label][candidate] = cost;
}

double DistanceConstraintMatcher::cost_of(const identify::InterMarkerDistance& constraint, double apart_m) {
  const double over = std::max({constraint.min_m - apart_m, apart_m - constraint.max_m, 0.0});
  const double sigmas = over / (kDistanceSigma_m + kRelativeDistanceSigma * constraint.max_m);
  return std::min(0.5 * sigmas * sigmas, kMaxDistanceCost);
}

bool DistanceConstraintMatcher::is_allowed(std::size_t label, std::size_t candidate, double unassigned_cost) const {
  if (!(costs_[label][candidate] < unassigned_cost)) return false;
  return excluded_ == nullptr || excluded_->candidate_of[label] == kUnassigned ||
         excluded_->candidate_of[label] == static_cast<int>(candidate);
}

// Sorts the candidates of each label by cost, and the labels so that those with most constraints to earlier labels, and
// fewest candidates, come first: a branch that violates a distance then ends early.
void DistanceConstraintMatcher::prepare(const identify::DistanceConstraints& constraints, double unassigned_cost) {
  for (std::size_t a = 0; a < label_count_; ++a) {
    constraint_between_[a].fill(nullptr);
    for (const identify::InterMarkerDistance& constraint : constraints.of(markers_[a])) {
      for (std::size_t b = 0; b < label_count_; ++b) {
        if (markers_[b] == static_cast<std::size_t>(constraint.other)) constraint_between_[a][b] = &constraint;
      }
    }
    choice_count_[a] = 0;
    for (std::size_t p = 0; p < candidate_count_; ++p) {
      if (is_allowed(a, p, unassigned_cost))
        choices_[a][choice_count_[a]++] = {static_cast<std::int8_t>(p), costs_[a][p]};
    }
    std::stable_sort(choices_[a].begin(), choices_[a].begin() + static_cast<std::ptrdiff_t>(choice_count_[a]),
                     [](const Choice& x, const Choice& y) { return x.cost < y.cost; });
  }
  std::array<bool, kMaxLimbLabels> ordered{};
  for (std::size_t i = 0; i < label_count_; ++i) {
    double best_score = -kForbidden;
    for (std::size_t n = 0; n < label_count_; ++n) {
      if (ordered[n]) continue;
      double score = -0.1 * static_cast<double>(choice_count_[n]);
      for (std::size_t k = 0; k < i; ++k) {
        const identify::InterMarkerDistance* constraint = constraint_between_[n][order_[k]];
        if (constraint != nullptr) score += constraint->rigid ? 1.0 : 0.25;
      }
      if (score > best_score) {
        best_score = score;
        order_[i] = n;
      }
    }
    ordered[order_[i]] = true;
  }
}

double DistanceConstraintMatcher::added_distance_cost(std::size_t depth, std::size_t candidate) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < depth; ++k) {
    const std::size_t other = order_[k];
    const identify::InterMarkerDistance* constraint = constraint_between_[order_[depth]][other];
    if (constraint == nullptr || current_[other] == kUnassigned) continue;
    sum += cost_of(*constraint, (positions_[candidate] - positions_[static_cast<std::size_t>(current_[other])]).norm());
  }
  return sum;
}

void DistanceConstraintMatcher::insert_assignment(double cost) {
  const auto at = std::upper_bound(hypotheses_.begin(), hypotheses_.end(), cost,
                                   [](double value, const AssignmentHypothesis& other) { return value < other.cost; });
  hypotheses_.insert(at, AssignmentHypothesis{cost, current_});
  if (hypotheses_.size() > max_hypotheses_) hypotheses_.pop_back();
}

// Depth-first search from the label order_[depth], with the cost of the labels before.
void DistanceConstraintMatcher::search(std::size_t depth, double cost, double unassigned_cost) {
  if (--steps_left_ < 0) return;
  if (hypotheses_.size() == max_hypotheses_ && cost >= hypotheses_.back().cost) return;
  if (depth == label_count_) {
    insert_assignment(cost);
    return;
  }
  const std::size_t label = order_[depth];
  for (std::size_t c = 0; c < choice_count_[label]; ++c) {
    const Choice& choice = choices_[label][c];
    const auto candidate = static_cast<std::size_t>(choice.candidate);
    if (taken_[candidate]) continue;
    const double more = choice.cost + added_distance_cost(depth, candidate);
    if (more > unassigned_cost) continue;  // cheaper unassigned
    taken_[candidate] = true;
    current_[label] = choice.candidate;
    search(depth + 1, cost + more, unassigned_cost);
    taken_[candidate] = false;
  }
  current_[label] = kUnassigned;
  search(depth + 1, cost + unassigned_cost, unassigned_cost);
}

std::span<const DistanceConstraintMatcher::AssignmentHypothesis> DistanceConstraintMatcher::solve(
    const identify::DistanceConstraints& constraints, double unassigned_cost) {
  hypotheses_.clear();
  prepare(constraints, unassigned_cost);
  taken_.fill(false);
  current_.fill(kUnassigned);
  steps_left_ = kMaxSearchSteps;
  search(0, 0.0, unassigned_cost);
  return hypotheses_;
}

std::span<const DistanceConstraintMatcher::AssignmentHypothesis> DistanceConstraintMatcher::solve_excluding(
    const identify::DistanceConstraints& constraints, double unassigned_cost, std::size_t label,
    const AssignmentHypothesis& excluded, std::size_t most) {
  double& own = costs_[label][static_cast<std::size_t>(excluded.candidate_of[label])];
  const double cost = std::exchange(own, kForbidden);
  max_hypotheses_ = std::min(most, kMaxAssignments);
  excluded_ = &excluded;
  (void)solve(constraints, unassigned_cost);
  excluded_ = nullptr;
  max_hypotheses_ = kMaxAssignments;
  own = cost;
  return hypotheses_;
}

void DistanceConstraintMatcher::archive(Archive& members) {
  members(label_count_, candidate_count_);
  if (label_count_ > kMaxLimbLabels || candidate_count_ > kMaxCandidates) members.fail();
  if (!members.ok()) return;
  for (std::size_t p = 0; p < candidate_count_; ++p) members(positions_[p]);
  for (std::size_t n = 0; n < label_count_; ++n) {
    members(markers_[n]);
    for (std::size_t p = 0; p < candidate_count_; ++p) members(costs_[n][p]);
  }
}

}  // namespace mocap::label
