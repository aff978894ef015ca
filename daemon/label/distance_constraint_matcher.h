#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "identify/distance_constraints.h"

namespace mocap::label {

/// Assigns candidate points to the markers of a limb by the distances that the body keeps: the k assignments with the
/// lowest cost, for a caller who compares them by pose. Reflected assignments have the same distances and are among
/// them.
///
/// Branch and bound over the interpretation tree of the limb, with pairwise distances as constraints, as in joint
/// compatibility branch and bound (Neira and Tardos 2001), but with the sum of pairwise costs instead of a joint
/// chi-square test. The search ends after 6000 nodes.
///
/// Costs are negative log likelihoods (half chi-square). Allocates in the constructor only. One thread.
class DistanceConstraintMatcher {
 public:
  static constexpr std::size_t kMaxLimbLabels = 16;
  static constexpr std::size_t kMaxCandidates = 40;
  static constexpr std::size_t kMaxAssignments = 6;
  static constexpr int kUnassigned = -1;

  struct AssignmentHypothesis {
    double cost = 0.0;
    std::array<std::int8_t, kMaxLimbLabels> candidate_of{};  ///< by label, in the order of `add_label`; or kUnassigned

    void archive(Archive& members) { members(cost, candidate_of); }
  };

  DistanceConstraintMatcher();

  void clear();
  /// Adds a label, of this marker of the marker set. Returns false if there are kMaxLimbLabels already.
  bool add_label(std::size_t marker);
  /// Adds a point. Returns false if there are kMaxCandidates already.
  bool add_candidate(const Eigen::Vector3d& at);
  std::size_t label_count() const { return label_count_; }
  std::size_t candidate_count() const { return candidate_count_; }
  std::size_t marker(std::size_t label) const { return markers_[label]; }
  const Eigen::Vector3d& candidate(std::size_t candidate) const { return positions_[candidate]; }

  /// Allows a candidate for a label, at this cost. Other candidates are forbidden.
  void allow(std::size_t label, std::size_t candidate, double cost);

  /// The at most kMaxAssignments cheapest assignments, best first. A label without a candidate costs `unassigned_cost`.
  /// `constraints` are of the marker set of the labels. The result is borrowed until the next call.
  std::span<const AssignmentHypothesis> solve(const identify::DistanceConstraints& constraints, double unassigned_cost);
  /// Alternatives to the candidate that `excluded` gives to `label`: the at most `most` cheapest assignments in which
  /// `label` does not have this candidate. A label with a candidate in `excluded` has this candidate or none; a label
  /// without one may have any. Requires that `excluded` has a candidate for `label`.
  std::span<const AssignmentHypothesis> solve_excluding(const identify::DistanceConstraints& constraints,
                                                        double unassigned_cost, std::size_t label,
                                                        const AssignmentHypothesis& excluded, std::size_t most);

  /// Cost of a distance of `apart_m` between two markers with this constraint, at most 20.
  static double cost_of(const identify::InterMarkerDistance& constraint, double apart_m);

  /// Writes labels, candidates and their costs, or takes them over (see Archive).
  void archive(Archive& members);

 private:
  struct Choice {
    std::int8_t candidate = kUnassigned;
    double cost = 0.0;
  };

  bool is_allowed(std::size_t label, std::size_t candidate, double unassigned_cost) const;
  void prepare(const identify::DistanceConstraints& constraints, double unassigned_cost);
  void search(std::size_t depth, double cost, double unassigned_cost);
  void insert_assignment(double cost);
  double added_distance_cost(std::size_t depth, std::size_t candidate) const;

  std::size_t label_count_ = 0;
  std::size_t candidate_count_ = 0;
  std::array<std::size_t, kMaxLimbLabels> markers_{};
  std::array<Eigen::Vector3d, kMaxCandidates> positions_;
  std::array<std::array<double, kMaxCandidates>, kMaxLimbLabels> costs_{};
  std::array<std::array<const identify::InterMarkerDistance*, kMaxLimbLabels>, kMaxLimbLabels>
      constraint_between_{};                                                  // by label and label; null: none
  std::array<std::array<Choice, kMaxCandidates>, kMaxLimbLabels> choices_{};  // by label, cheapest first
  std::array<std::size_t, kMaxLimbLabels> choice_count_{};
  std::array<std::size_t, kMaxLimbLabels> order_{};
  std::array<bool, kMaxCandidates> taken_{};
  std::array<std::int8_t, kMaxLimbLabels> current_{};
  int steps_left_ = 0;
  std::size_t max_hypotheses_ = kMaxAssignments;
  const AssignmentHypothesis* excluded_ = nullptr;  // its labels with a candidate have no other candidate
  std::vector<AssignmentHypothesis> hypotheses_;
};

}  // namespace mocap::label
