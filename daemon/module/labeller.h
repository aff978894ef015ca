#pragma once

#include <optional>

#include "base/archive.h"
#include "model/handover.h"
#include "model/predictions.h"
#include "model/search_report.h"
#include "model/sighting.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"

namespace mocap {

/// The result of a Labeller for one set.
struct Labelling {
  Labels labels;
  AmbiguousObservations ambiguous_observations;  ///< tracks without a label that certainly belong to a subject
  /// A subject that was fitted in this set; at most one a set, a second one follows in the next set. The caller numbers
  /// its `description_version`.
  std::optional<SubjectFit> fit;
  /// Evidence for one subject that has been missing for a second, about once a second and subject, without the views;
  /// null: no report in this set. Borrowed like the labelling.
  const SearchReport* search = nullptr;
};

/// Gives labels to 3D tracks: the first labels of a subject, then labels from set to set.
///
/// One thread makes all calls.
class Labeller {
 public:
  virtual ~Labeller() = default;

  /// Labels the tracks of one set, at `predicted.at`. The result is borrowed until the next call of `label`.
  virtual const Labelling& label(const TrackedMarkers& tracked, const Predictions& predicted) = 0;

  /// From now on the bones and the marker offsets of the subject are those of `fit`.
  virtual void refit(const SubjectFit& fit) = 0;

  /// Forgets the position and the fit of a subject; the labeller searches for the subject again. A labeller without
  /// memory does nothing.
  virtual void reset(SubjectId /*subject*/) {}

  /// A subject that is away gets no labels and is not searched for. All subjects are present at the start.
  virtual void set_away(SubjectId /*subject*/, bool /*away*/) {}

  /// Takes over the belief of the labeller of the configuration before, which is not used afterwards: the labels and
  /// the bodies of the subjects that continue. Call before the first `label`; allocates. A labeller without memory, or
  /// of another kind than `before`, does nothing.
  virtual void adopt(Labeller& /*before*/, const Handover& /*handover*/) {}

  /// Writes the belief, or takes it over from a labeller that was built with the same settings. Call between two sets.
  /// A labeller without memory does nothing.
  virtual void archive(Archive& /*members*/) {}
};

}  // namespace mocap
