#pragma once

#include <memory>
#include <utility>

#include "associate/multi_view_matcher.h"
#include "model/identity_map.h"

namespace mocap::associate {

/// A matcher with the identity map that Fusion uses: the predictions include the identities of 2D tracks.
class IdentifiedMatcher {
 public:
  explicit IdentifiedMatcher(const Rig& rig) : matcher_(make_matcher({}, rig)), identities_(rig.size()) {}

  /// Matches one set. Precondition: the predicted markers have their tracks and labels.
  const Matches& match(const FrameSet& frames, const PredictedMarkers& predicted) {
    const Matches& matches = matcher_->match(frames, identities_.predict(frames, predicted, {}));
    identities_.update(frames, matches, {});
    return matches;
  }

 private:
  std::unique_ptr<Matcher> matcher_;
  IdentityMap identities_;
};

}  // namespace mocap::associate
