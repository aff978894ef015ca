#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "lib/scoring/frames.h"
#include "lib/simworld/scene_actors.h"

namespace mocap::eval {

/// The part of the subjects that a scene scores ([score] of the scene file).
class ScoredPart {
 public:
  /// `below`: names of bones separated by spaces: the bones below them and the markers on those are scored; empty:
  /// everything. Fails with InvalidArgument if a subject has no bone of such a name.
  static Result<ScoredPart> make(const std::string& below, const std::vector<simworld::Performer>& performers);

  /// The frame without the markers and bones that are not scored.
  scoring::EvalFrame of(const scoring::EvalFrame& frame) const;

 private:
  struct Subject {
    std::vector<bool> bones, markers;  // scored, by index
  };
  std::vector<Subject> subjects_;  // empty: everything is scored
};

}  // namespace mocap::eval
