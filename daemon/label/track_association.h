#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/assignment.h"
#include "label/subject_labeller.h"

namespace mocap::label {

/// Which name of which subject bears which track: all claims of all bodies at once, so that two bodies that touch
/// compete for a track by where each of them should be.
///
/// Allocates in the constructor only.
class TrackAssociation {
 public:
  explicit TrackAssociation(std::size_t max_labels);

  /// Of the subjects that are being tracked, after their `expect`.
  void associate(std::vector<SubjectLabeller>& subjects, LabelledTracks& tracks);

 private:
  struct SwapSuspect {
    std::size_t subject = 0;
    std::size_t marker = 0;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d predicted = Eigen::Vector3d::Zero();
  };

  void distrust_swapped(std::vector<SubjectLabeller>& subjects, const LabelledTracks& tracks);
  void index(std::size_t rows, std::span<const std::uint32_t> columns);
  bool is_clear(const geometry::AllowedPair& candidate, std::span<const std::uint32_t> columns) const;
  bool may_be_swapped(const geometry::AllowedPair& candidate, std::span<const std::uint32_t> columns) const;
  double cost_of(std::uint32_t row, std::uint32_t column) const;

  std::size_t max_labels_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;  // by row
  std::vector<std::size_t> first_pair_;       // by row, and the end
  std::vector<std::uint32_t> row_of_;         // by column, as assigned; kAlone
  std::vector<std::size_t> first_row_;        // by subject
  std::vector<SwapSuspect> swap_suspects_;
};

}  // namespace mocap::label
