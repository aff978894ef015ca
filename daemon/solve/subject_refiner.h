#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/archive.h"
#include "base/time.h"
#include "bodyfit/body_offsets.h"
#include "bodyfit/subject_fitter.h"
#include "model/handover.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "solve/refine_settings.h"

namespace mocap::solve {

/// Refines the body models while subjects are tracked. The refiner stores the most different poses of each subject,
/// fits bone lengths and marker offsets to them by bundle adjustment (`bodyfit::SubjectFitter`; Triggs et al. 2000),
/// some steps in each set, and adopts the result if stored poses that were not part of the fit have lower residuals.
///
/// A subject that was identified in a rest pose is constrained to it, so that the bone frames agree with the rest pose.
/// The first fit is to this pose alone, and is adopted without such a validation.
/// For a subject that was fitted before, the bone lengths are known and the markers may have been attached anew. They
/// are unknown again when a new body is fitted at an identification: another person may wear the markers.
///
/// Allocates in the constructor only. Reads no clock: the same sets give the same fits. One thread.
class SubjectRefiner {
 public:
  SubjectRefiner(const RefineSettings& settings, const std::vector<Subject>& subjects);

  /// A subject was identified, in a rest pose unless the fit says otherwise, and has this body model from now on. Its
  /// stored poses are discarded.
  void recognised(const SubjectFit& fit);

  /// The subject was reset: discards its stored poses and ends its fit. Nothing is stored until it is `recognised`, or
  /// tracked if it is rigid.
  void forget(SubjectId subject);

  /// Takes over the subjects that continue: their bodies, what is known of them and, with equal settings, their stored
  /// poses and the fit in progress. `before` is not used afterwards. Call before the first `step`; allocates.
  void adopt(SubjectRefiner& before, const Handover& handover);

  /// Stores the poses of one set if they are new, and does `pieces` steps of work for one subject. Returns a body model
  /// that is better than the current one, which takes effect from the next set on. The caller sets its
  /// `description_version`.
  std::optional<SubjectFit> step(const Labels& labels, const Poses& poses, Timestamp at);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  class SubjectRefinement;

 public:
  ~SubjectRefiner();
  SubjectRefiner(SubjectRefiner&&) noexcept;

 private:
  RefineSettings settings_;
  std::vector<SubjectRefinement> subjects_;
  std::size_t next_subject_ = 0;  // subject of the next work
};

}  // namespace mocap::solve
