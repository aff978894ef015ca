#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "identify/distance_constraints.h"

namespace mocap::label {

/// Finds which of a few places are which of a few markers, by the distances that the body keeps: the cheapest readings
/// of a limb, mirrored ones among them, for somebody to judge who knows how joints turn.
///
/// Allocates in the constructor only.
class DistanceConstraintMatcher {
 public:
  static constexpr std::size_t kMaxLimbLabels = 16;
  static constexpr std::size_t kMaxCandidates = 40;
  static constexpr std::size_t kMaxAssignments = 6;
  static constexpr int kUnassigned = -1;

  struct AssignmentHypothesis {
    double cost = 0.0;
    std::array<std::int8_t, kMaxLimbLabels> candidate_of{};  ///< by name in the order of `add_label`; kUnassigned
  };

  DistanceConstraintMatcher();

  void clear();
  /// False when there are too many already.
  bool add_label(std::size_t marker);
  bool add_candidate(const Eigen::Vector3d& at);
  std::size_t label_count() const { return label_count_; }
  std::size_t candidate_count() const { return candidates_; }
  std::size_t marker(std::size_t label) const { return markers_[label]; }
  const Eigen::Vector3d& candidate(std::size_t candidate) const { return at_[candidate]; }

  /// What it costs, in half squared sigmas, that a name is at a place. A name may be nowhere else.
  void allow(std::size_t label, std::size_t candidate, double cost);

  /// The cheapest readings, best first; a name that is nowhere costs `unassigned_cost`. Borrowed until the next call.
  std::span<const AssignmentHypothesis> solve(const identify::DistanceConstraints& constraints, double unassigned_cost);
  /// Who else may be where `excluded` has a name: the cheapest `most` readings in which it is nowhere, and all others
  /// as before, nowhere or, which were nowhere, anywhere.
  std::span<const AssignmentHypothesis> solve_excluding(const identify::DistanceConstraints& constraints,
                                                        double unassigned_cost, std::size_t label,
                                                        const AssignmentHypothesis& excluded, std::size_t most);

  /// What it costs that two markers so tied are `apart_m`.
  static double cost_of(const identify::InterMarkerDistance& constraint, double apart_m);

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
  std::size_t candidates_ = 0;
  std::array<std::size_t, kMaxLimbLabels> markers_{};
  std::array<Eigen::Vector3d, kMaxCandidates> at_;
  std::array<std::array<double, kMaxCandidates>, kMaxLimbLabels> costs_{};
  std::array<std::array<const identify::InterMarkerDistance*, kMaxLimbLabels>, kMaxLimbLabels>
      constraint_between_{};                                                  // null: none
  std::array<std::array<Choice, kMaxCandidates>, kMaxLimbLabels> choices_{};  // by name, cheapest first
  std::array<std::size_t, kMaxLimbLabels> choice_count_{};
  std::array<std::size_t, kMaxLimbLabels> order_{};
  std::array<bool, kMaxCandidates> taken_{};
  std::array<std::int8_t, kMaxLimbLabels> current_{};
  int steps_left_ = 0;
  std::size_t most_ = kMaxAssignments;
  const AssignmentHypothesis* excluded_ = nullptr;  // names that are somewhere there have no other place
  std::vector<AssignmentHypothesis> hypotheses_;
};

}  // namespace mocap::label
