#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/assignment.h"
#include "stages/label_subject.h"

namespace mocap::stages {

/// Which name of which subject bears which track: all claims of all bodies at once, so that two bodies that touch
/// compete for a track by where each of them should be.
///
/// Allocates in the constructor only.
class TrackClaims {
 public:
  explicit TrackClaims(std::size_t most_names);

  /// Of the subjects that are being tracked, after their `expect`.
  void settle(std::vector<SubjectLabeller>& subjects, NamedTracks& tracks);

 private:
  struct Suspect {
    std::size_t subject = 0;
    std::size_t marker = 0;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d told = Eigen::Vector3d::Zero();
  };

  void doubt_exchanged(std::vector<SubjectLabeller>& subjects, const NamedTracks& tracks);
  bool is_clear(const geometry::AllowedPair& claim, std::span<const std::uint32_t> columns) const;

  std::size_t most_names_;
  geometry::Assigner assigner_;
  std::vector<geometry::AllowedPair> pairs_;
  std::vector<std::size_t> first_row_;  // by subject
  std::vector<Suspect> suspects_;
};

}  // namespace mocap::stages
