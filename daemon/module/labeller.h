#pragma once

#include <optional>
#include <span>

#include "model/sighting.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"

namespace mocap {

/// Gives markers their names: at first by the shape of the body, then by keeping them.
class Labeller {
 public:
  virtual ~Labeller() = default;

  /// The names at `expected.at`. The result is borrowed until the next call.
  virtual const Labels& label(const TrackedMarkers& tracked, const Expected& expected) = 0;

  /// Of the last call, the tracks that are surely somebody's and bear no name. Borrowed until the next call.
  virtual std::span<const AmbiguousObservation> ambiguous_observations() const = 0;

  /// The fit of a subject that was made since the last call; most calls have none. Its `description_version` is left
  /// to the caller.
  virtual std::optional<SubjectFit> take_fit() = 0;

  /// From now on this subject's bones and markers are as fitted by somebody else.
  virtual void refit(const SubjectFit& fit) = 0;

  /// Forgets where this subject is and how it measures: the next T-pose tells. A labeller without memory need do
  /// nothing.
  virtual void reset(SubjectId) {}

  /// A subject that is away bears no names and is not looked for. All are there at the start.
  virtual void set_away(SubjectId, bool) {}
};

}  // namespace mocap
