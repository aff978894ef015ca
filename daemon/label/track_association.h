#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/assignment.h"
#include "label/subject_labeller.h"

namespace mocap::label {

/// Assigns tracks to the labels of all subjects at once: a global nearest neighbour assignment (Bar-Shalom, Li and
/// Kirubarajan 2001) over the costs of `SubjectLabeller`. Two bodies that touch compete for a track by their predicted
/// positions.
///
/// An assignment is made only if no alternative is about as likely; otherwise the label waits for
/// `LimbHypothesisSolver`.
///
/// Allocates in the constructor only. One thread.
class TrackAssociation {
 public:
  /// `max_labels`: labels of all subjects.
  explicit TrackAssociation(std::size_t max_labels);

  /// Fits the body of each tracked subject and updates its labels. Requires `SubjectLabeller::predict` before.
  void associate(std::vector<SubjectLabeller>& subjects, LabelledTracks& tracks);

 private:
  struct SwapSuspect {
    std::size_t subject = 0;
    std::size_t marker = 0;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d predicted = Eigen::Vector3d::Zero();
  };

  void distrust_swapped(std::vector<SubjectLabeller>& subjects, const LabelledTracks& tracks);
  void index_assignment(std::size_t rows, std::span<const std::uint32_t> columns);
  bool is_clear(const geometry::AllowedPair& candidate, std::span<const std::uint32_t> columns) const;
  bool may_be_swapped(const geometry::AllowedPair& candidate, std::span<const std::uint32_t> columns) const;
  double cost_of(std::uint32_t row, std::uint32_t column) const;

  std::size_t max_labels_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;  // sorted by row
  std::vector<std::size_t> first_pair_;       // by row, and one past the last: index into pairs_
  std::vector<std::uint32_t> row_of_;         // by column: the assigned row, or kUnassigned
  std::vector<std::size_t> first_row_;        // by subject
  std::vector<SwapSuspect> swap_suspects_;
};

}  // namespace mocap::label
