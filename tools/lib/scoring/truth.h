#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "lib/scoring/frames.h"

namespace mocap::scoring {

/// The truth at any instant, straight on between the instants at which it is known.
class Truth {
 public:
  /// Fails with InvalidArgument when there are no frames or their instants do not rise.
  static Result<Truth> of(std::vector<EvalFrame> frames);

  /// Markers and bones that both neighbouring frames know. Outside the known instants, and where frames are missing in
  /// the truth, the nearest frame where it is within half a period; otherwise nothing.
  std::optional<EvalFrame> at(Timestamp when) const;

  /// Median distance of its instants; a second where there is one frame only.
  Duration period() const { return period_; }

 private:
  Truth(std::vector<EvalFrame> frames, Duration period) : frames_(std::move(frames)), period_(period) {}

  std::vector<EvalFrame> frames_;
  Duration period_;
};

}  // namespace mocap::scoring
