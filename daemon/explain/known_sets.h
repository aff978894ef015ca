#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "explain/pose_attempt.h"
#include "explain/search_evidence.h"

namespace mocap::explain {

/// The marker sets with which the points of a subject that is not found are compared.
class KnownSets {
 public:
  /// A set that a configured subject wears is left out: its markers may be those of that subject.
  KnownSets(const std::vector<MarkerSet>& sets, const std::vector<Subject>& subjects, const ExplainSettings& settings);

  /// The set whose pose explains most points, and more than `own`, the best pose of the subject's set `own_set`; a
  /// person's set explains at least `least_share` of the markers. Nothing for a rigid body of three markers, which
  /// chance triples resemble. `confirmed`: points at the front of `points` that are markers.
  std::optional<KnownSet> nearest(const MarkerSet& own_set, const PoseAttempt& own,
                                  std::span<const Eigen::Vector3d> points, std::size_t confirmed);

 private:
  struct Known {
    std::string name;
    std::size_t markers;
    bool is_rigid;
    PoseAttempts attempts;
  };

  double least_share_;
  std::vector<Known> sets_;
};

}  // namespace mocap::explain
