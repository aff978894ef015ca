#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/time.h"
#include "bodyfit/body_offsets.h"
#include "bodyfit/subject_fitter.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "solve/refine_settings.h"

namespace mocap::solve {

/// Makes bodies better known while they are tracked: keeps the most different poses of each, fits its bones and markers
/// to them, a little in each set, and gives the fit when poses that it was not fitted to agree.
///
/// A subject that was recognised in its rest pose is held to that: so each bone's frame lies on it as the rest pose
/// says. Of one that was fitted before, bones are believed and markers may have been stuck on anew.
///
/// Allocates in the constructor only. Reads no clock: the same sets give the same fits. One thread.
class SubjectRefiner {
 public:
  SubjectRefiner(const RefineSettings& settings, const std::vector<Subject>& subjects);

  /// A subject was recognised in rest pose and is worn so; what was known of it is forgotten.
  void recognised(const SubjectFit& fit);

  /// Looks at what one set shows, and works a little. A fit that is better than what is worn, from the next set on;
  /// its `description_version` is left to the caller.
  std::optional<SubjectFit> step(const Labels& labels, const Poses& poses, Timestamp at);

 private:
  class SubjectRefinement;

 public:
  ~SubjectRefiner();
  SubjectRefiner(SubjectRefiner&&) noexcept;

 private:
  RefineSettings settings_;
  std::vector<SubjectRefinement> subjects_;
  std::size_t next_subject_ = 0;  // whose work it is
};

}  // namespace mocap::solve
