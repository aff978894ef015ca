#pragma once

#include <span>

#include "base/archive.h"
#include "base/time.h"
#include "model/handover.h"
#include "model/predictions.h"
#include "model/sighting.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"

namespace mocap {

/// The skeletons of all subjects at one instant.
struct SolvedSubjects {
  Labels
      labels;  ///< the labels that were given, with the position of each unobserved marker from the skeleton (Filled)
  Poses poses;
};

/// Solves skeletons from labelled markers.
///
/// One thread makes all calls.
class SkeletonSolver {
 public:
  virtual ~SkeletonSolver() = default;

  /// Solves the poses at `at` from the measured markers of `labels`, from the bearings of markers that one camera sees,
  /// and from ambiguous observations. The result is borrowed until the next call.
  virtual const SolvedSubjects& solve(const Labels& labels, Timestamp at,
                                      std::span<const LabelledBearing> bearings = {},
                                      std::span<const AmbiguousObservation> ambiguous_observations = {}) = 0;

  /// From now on the bones and the marker offsets of the subject are those of `fit`.
  virtual void refit(const SubjectFit& fit) = 0;

  /// Predicts the position of each marker of each tracked subject at `at`, with `label` set and without a track. Does
  /// not change the poses. The result is borrowed until the next call.
  virtual const PredictedMarkers& predict(Timestamp at) = 0;

  /// Takes over the bodies and the poses of the subjects that continue from the solver of the configuration before,
  /// which is not used afterwards. Call before the first `solve`; allocates. A solver without memory, or of another
  /// kind than `before`, does nothing.
  virtual void adopt(SkeletonSolver& /*before*/, const Handover& /*handover*/) {}

  /// Writes the belief, or takes it over from a solver that was built with the same settings. Call between two sets. A
  /// solver without memory does nothing.
  virtual void archive(Archive& /*members*/) {}
};

}  // namespace mocap
