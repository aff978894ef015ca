#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "base/result.h"
#include "lib/scoring/frames.h"

namespace mocap::scoring {

/// The truth at any instant. Between the known instants, positions are interpolated linearly and rotations by slerp.
class Truth {
 public:
  /// Fails with InvalidArgument if `frames` is empty or its instants do not increase strictly.
  static Result<Truth> of(std::vector<EvalFrame> frames);

  /// The markers and bones that both neighbouring frames contain. Outside the known instants, and in a gap of the
  /// truth, the nearest frame if it is at most half a period away; otherwise empty.
  std::optional<EvalFrame> at(Timestamp when) const;

  /// The median period of the frames. 1 s if there is only one frame.
  Duration period() const { return period_; }

 private:
  Truth(std::vector<EvalFrame> frames, Duration period) : frames_(std::move(frames)), period_(period) {}

  std::vector<EvalFrame> frames_;
  Duration period_;
};

}  // namespace mocap::scoring
