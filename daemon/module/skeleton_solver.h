#pragma once

#include <span>

#include "base/time.h"
#include "model/sighting.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"

namespace mocap {

/// Turns named markers into bones.
class SkeletonSolver {
 public:
  virtual ~SkeletonSolver() = default;

  /// The poses at `at`, told by the markers that `labels` has measured, by the rays of those that it has not and by
  /// those that are surmised, and, in `labels`, the place of each marker that nobody saw but the body tells (Filled).
  /// The result is borrowed until the next call.
  virtual const Poses& solve(Labels& labels, Timestamp at, std::span<const LabelledBearing> rays = {},
                             std::span<const AmbiguousObservation> ambiguous_observations = {}) = 0;

  /// From now on this subject's bones and markers are as fitted.
  virtual void refit(const SubjectFit& fit) = 0;

  /// Appends where the body says that each marker of a tracked subject should be at `at`, with `label` set.
  virtual void predict(Timestamp at, Expected& into) const = 0;
};

}  // namespace mocap
